"""Decoding of the messages of a real robot's log by the role (purpose) of the topic."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from simscen.record import topics
from simscen.record.foreign.options import TOPICS, ForeignLogOptions
from simscen.record.foreign.raw_messages import Decoders, InvalidPose, RawMessage
from simscen.record.messages import decode
from simscen.record.messages.decode import MessageReader


def _stamp(reader: MessageReader) -> int:
    """Decode only the stamp of a message with a header, and skip the other fields."""
    stamp, _ = reader.header()
    reader.blob(reader.remaining)
    return stamp


DECODERS: dict[str, Decoders] = {
    "truth": decode.POSE_DECODERS,
    "odom": {topics.ODOMETRY_TYPE: decode.odometry},
    "amcl_pose": decode.POSE_DECODERS,
    "scan": {topics.SCAN_TYPE: _stamp},
    "cmd_vel": {
        "geometry_msgs/msg/Twist": decode.twist,
        "geometry_msgs/msg/TwistStamped": decode.twist_stamped,
    },
    "plan": {topics.PLAN.type: decode.path},
    "tf": {topics.TF.type: decode.transforms},
    "tf_static": {topics.TF.type: decode.transforms},
    "status": {"action_msgs/msg/GoalStatusArray": decode.goal_states},
}
"""Decoders by role and message type. The decoder of scans returns only the stamp."""


@dataclass
class DecodedMessages:
    """Decoded messages of a log.

    Attributes:
        by_role: Pairs of the time of logging in ns and a decoded message, by role.
        problems: Reason why messages of a role could not be decoded, by role.
        invalid_poses: Number of messages that are ignored because of an invalid orientation, by topic.
    """

    by_role: dict[str, list[tuple[int, Any]]] = field(default_factory=lambda: defaultdict(list))
    problems: dict[str, str] = field(default_factory=dict)
    invalid_poses: Counter[str] = field(default_factory=Counter)


def topic_roles(options: ForeignLogOptions) -> dict[str, list[str]]:
    """Return the roles of each topic. The topic of the ground truth has the role `truth`, and can have another role."""
    roles: dict[str, list[str]] = defaultdict(list)
    for role in TOPICS:
        roles[options.topic(role)].append(role)
    if options.truth is not None and options.frames is None:
        roles[options.truth].append("truth")
    return dict(roles)


def decode_messages(raw: Iterable[RawMessage], roles: Mapping[str, Sequence[str]]) -> DecodedMessages:
    """Decode the messages of all topics with a role. `roles` are the roles of each topic.

    A topic with an unsuitable message type or encoding is added to `problems`. Raises UnusableLog for an invalid
    message.
    """
    decoded = DecodedMessages()
    for message in raw:
        message_roles = roles.get(message.topic, ())
        for role in message_roles:
            messages = decoded.by_role[role]
            if mismatch := message.mismatch(DECODERS[role]):
                decoded.problems[role] = mismatch
                continue
            try:
                messages.append((message.time, message.decode(DECODERS[role], f"message {len(messages) + 1}")))
            except InvalidPose:
                decoded.invalid_poses[message.topic] += role == message_roles[0]  # count each message once
    for topic in decoded.invalid_poses:
        empty_roles = [role for role in roles[topic] if not decoded.by_role[role]]
        decoded.problems |= dict.fromkeys(empty_roles, f"all messages of {topic} have an invalid orientation")
    return decoded
