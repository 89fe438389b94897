"""Decoder of the messages of a real robot's log by the role (purpose) of their topics."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from simscen.record.foreign.options import TOPICS, ForeignLogOptions
from simscen.record.foreign.raw_messages import RawMessage, UnusableLog
from simscen.record.messages import decode
from simscen.record.messages.decode import CheckedReader, decode_checked

_POSE_DECODERS = {name: partial(decode_checked, decoder) for name, decoder in decode.POSE_DECODERS.items()}
_TRANSFORM_DECODERS = {"tf2_msgs/msg/TFMessage": partial(decode_checked, decode.transforms)}
_DECODERS: Mapping[str, Mapping[str, Callable[[bytes], Any]]] = {
    "truth": _POSE_DECODERS,
    "odom": {"nav_msgs/msg/Odometry": partial(decode_checked, decode.odometry)},
    "amcl_pose": _POSE_DECODERS,
    "scan": {"sensor_msgs/msg/LaserScan": lambda data: CheckedReader(data).header()[0]},
    "cmd_vel": {
        "geometry_msgs/msg/Twist": partial(decode_checked, decode.twist),
        "geometry_msgs/msg/TwistStamped": partial(decode_checked, decode.twist_stamped),
    },
    "plan": {"nav_msgs/msg/Path": partial(decode_checked, decode.path)},
    "tf": _TRANSFORM_DECODERS,
    "tf_static": _TRANSFORM_DECODERS,
    "status": {"action_msgs/msg/GoalStatusArray": partial(decode_checked, decode.goal_states)},
}
"""Decoders by role and message type. The decoder of scans returns only the stamp."""


@dataclass
class DecodedMessages:
    """Times of logging in ns and decoded messages, by role.

    `problems` are the reasons why messages of a role could not be decoded.
    """

    by_role: dict[str, list[tuple[int, Any]]] = field(default_factory=lambda: defaultdict(list))
    problems: dict[str, str] = field(default_factory=dict)


def topic_roles(options: ForeignLogOptions) -> dict[str, list[str]]:
    """Return the roles of each topic. The topic of the ground truth has the role `truth`, and may have another role."""
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
        for role in roles.get(message.topic, ()):
            _decode(decoded, role, message)
    return decoded


def _decode(decoded: DecodedMessages, role: str, message: RawMessage) -> None:
    """Add a message to `decoded`, or the reason why it is unsuitable for the role."""
    decoders, messages = _DECODERS[role], decoded.by_role[role]
    if message.encoding != "cdr":
        encoding = message.encoding or "something unknown"
        decoded.problems[role] = f"{message.topic} is encoded as {encoding}, not as CDR"
        return
    if message.type not in decoders:
        expected = " or ".join(decoders)
        decoded.problems[role] = f"{message.topic} is a {message.type or 'type without a name'}, expected {expected}"
        return
    try:
        messages.append((message.time, decoders[message.type](message.data)))
    except (ValueError, OverflowError) as error:
        where = f"message {len(messages) + 1} of {message.topic}"
        raise UnusableLog(f"{where} cannot be read as {message.type}: {error}") from error
