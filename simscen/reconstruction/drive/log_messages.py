"""Reads and decodes the messages of a log that a reconstruction uses, by the role of the topic.

A role is the purpose of a topic, such as `odom` or `goal`. Each role has a default topic. The log time of a message is
the time at which the recorder received the message. The clock of the stamps can have another origin or rate than the
clock of the log times.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Container, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from simscen.core.clock import NS_PER_SECOND
from simscen.record import topics
from simscen.record.foreign.decoded_messages import DECODERS
from simscen.record.foreign.options import TOPICS
from simscen.record.foreign.raw_messages import (
    Decoders,
    InvalidPose,
    RawMessage,
    UnusableLog,
    open_messages,
    type_mismatch,
)
from simscen.record.foreign.timebase import MIN_CLOCK_RATE, to_clock_of_stamps
from simscen.record.frame_names import RobotFrames
from simscen.record.messages import decode
from simscen.record.messages.decode import MessageReader


class LoggedMessage(NamedTuple):
    """A decoded message with log time and header stamp in ns. The stamp is 0 if the message has no header."""

    log_time: int
    stamp: int
    content: Any


class ImuMessage(NamedTuple):
    """Part of sensor_msgs/msg/Imu: stamp in ns, frame, and turn rate in rad/s about the vertical axis."""

    stamp: int
    frame: str
    turn_rate: float


class PolygonMessage(NamedTuple):
    """geometry_msgs/msg/PolygonStamped: stamp in ns, frame, and corners (x, y) in m."""

    stamp: int
    frame: str
    corners: tuple[tuple[float, float], ...]


EXTRA_TOPICS = {
    "imu": "/imu",
    "bumper": "/bumper",
    "map": topics.MAP.name,
    "goal": topics.GOAL.name,
    "footprint": "/local_costmap/published_footprint",
    "events": topics.EVENTS.name,
}
"""Default topics by role, for roles that only a reconstruction uses. The other roles are in TOPICS."""
TOPIC_ROLES = (*TOPICS, *(role for role in EXTRA_TOPICS if role != "events"))
"""Roles whose topic users can change with `--topic NAME=TOPIC`."""


def decode_imu(reader: MessageReader) -> ImuMessage:
    """Decode sensor_msgs/msg/Imu."""
    stamp, frame = reader.header()
    reader.take("13d")
    turn_rate = reader.take("3d")[2]
    reader.take("21d")
    return ImuMessage(stamp, frame, turn_rate)


def decode_polygon(reader: MessageReader) -> PolygonMessage:
    """Decode geometry_msgs/msg/PolygonStamped."""
    stamp, frame = reader.header()
    corners = (reader.take("3f") for _ in range(reader.count()))
    return PolygonMessage(stamp, frame, tuple((x, y) for x, y, _ in corners))


_DECODERS: dict[str, Decoders] = {
    **DECODERS,
    "goal": decode.POSE_DECODERS,
    "scan": {topics.SCAN_TYPE: decode.laser_scan},
    "imu": {topics.IMU_TYPE: decode_imu},
    "bumper": {topics.BUMPER_TYPE: lambda reader: bool(reader.take("?")[0])},
    "map": {topics.MAP.type: lambda reader: decode.occupancy_grid(reader)[1]},
    "footprint": {"geometry_msgs/msg/PolygonStamped": decode_polygon},
    "events": {topics.EVENTS.type: MessageReader.string},
}
"""Decoders by role and message type."""


@dataclass
class LogMessages:
    """Messages of a log.

    Attributes:
        by_role: Messages by role, in the order of log times.
        topics: Message types of all topics, by topic.
        is_complete: False for a truncated log.
        notes: Phrases for the user that complete the sentence "The log does not show …".
    """

    by_role: dict[str, list[LoggedMessage]] = field(default_factory=dict)
    topics: dict[str, str] = field(default_factory=dict)
    is_complete: bool = True
    notes: list[str] = field(default_factory=list)

    def get(self, role: str) -> list[LoggedMessage]:
        """Return the messages of a role; [] if the log has no messages of this role."""
        return self.by_role.get(role, [])


def collect_messages(
    path: Path, chosen_topics: Mapping[str, str], has_truth: bool = False, robot: str = ""
) -> LogMessages:
    """Read the messages of an MCAP file or a rosbag2 folder.

    If the default scan topic has no messages, the scans of another topic are used. Raises UnusableLog if the log cannot
    be read, or if one of `chosen_topics` has no usable messages.

    chosen_topics:  topics by role, for roles whose topic is not the default, and for the role "truth"
    has_truth:      whether the log may have simscen's own ground truth
    robot:          in a simscen log with several robots, the robot whose messages are read. Its name is removed from
        topics and frames.
    """
    prefix = f"/{robot}" if robot else ""
    namespace, frame_prefix = f"{prefix}/" if robot else "", RobotFrames(robot).prefix
    names = {**TOPICS, **EXTRA_TOPICS, **({"truth": topics.TRUTH.name} if has_truth else {}), **chosen_topics}
    absolute_names = {role: topic if topic.startswith(namespace) else prefix + topic for role, topic in names.items()}
    roles: dict[str, list[str]] = {}
    for role in sorted(names):
        roles.setdefault(absolute_names[role], []).append(role)
    stream = open_messages(path, _TopicsToRead(roles) if path.is_dir() else roles)
    messages = LogMessages()
    other_scans: dict[str, list[LoggedMessage]] = {}
    invalid_poses: Counter[str] = Counter()
    for raw in stream:
        for role in roles.get(raw.topic, ()):
            if raw.type in _DECODERS[role]:
                try:
                    messages.by_role.setdefault(role, []).append(_decode(raw, role, frame_prefix))
                except InvalidPose:
                    invalid_poses[raw.topic] += role == roles[raw.topic][0]  # count each message once
        if raw.topic not in roles and raw.type == topics.SCAN_TYPE and raw.topic.startswith(namespace):
            other_scans.setdefault(raw.topic, []).append(_decode(raw, "scan", frame_prefix))
    messages.notes += [
        f"{count} poses on {topic}, whose orientation is invalid" for topic, count in invalid_poses.items()
    ]
    for role in chosen_topics:
        if not messages.get(role):
            topic, hint = absolute_names[role], f"its topics: {', '.join(sorted(stream.topics)[:12]) or 'none'}"
            if topic not in stream.topics:
                raise UnusableLog(f"it has no topic {topic}", hint)
            if topic in invalid_poses:
                raise UnusableLog(f"all messages of {topic} have an invalid orientation", hint)
            raise UnusableLog(type_mismatch(topic, stream.topics[topic], _DECODERS[role]) or f"{topic} is empty", hint)
    if not messages.get("scan") and other_scans:
        topic = min(other_scans)
        messages.by_role["scan"] = other_scans[topic]
        messages.notes.append(f"scans on {names['scan']}; the scans on {topic} are used, see --topic scan=/TOPIC")
    robot_topics = {name: kind for name, kind in stream.topics.items() if name.startswith(namespace)}
    messages.topics = {name.removeprefix(prefix): kind for name, kind in robot_topics.items()}
    messages.is_complete = stream.is_complete
    for role_messages in messages.by_role.values():
        role_messages.sort(key=lambda message: message.log_time)
    return messages


class _TopicsToRead:
    """Container of the topics to read: topics with a role, and topics with "scan" in their name."""

    def __init__(self, topics_with_role: Container[str]) -> None:
        self._topics_with_role = topics_with_role

    def __contains__(self, topic: object) -> bool:
        return topic in self._topics_with_role or "scan" in str(topic)


def _decode(raw: RawMessage, role: str, frame_prefix: str) -> LoggedMessage:
    """Return the decoded message. Raises InvalidPose or UnusableLog if it is invalid."""
    message = raw.decode(_DECODERS[role], frame_prefix=frame_prefix)
    return LoggedMessage(raw.time, getattr(message, "stamp", 0) or 0, message)


MAX_CLOCK_DIFFERENCE_NS = 10 * NS_PER_SECOND
"""Maximum difference between the stamp and the log time of a message if both are from the same clock."""
MAX_CLOCK_RATE_ERROR = 0.002
"""Maximum deviation of a clock rate from 1. With a larger deviation, the clock runs in slow motion or time lapse."""


def _messages_with_stamp(messages: LogMessages) -> list[list[LoggedMessage]]:
    """Return the messages with a stamp of each role whose stamps are compared with the log times."""
    roles = ("scan", "odom", "amcl_pose", "truth")
    return [[message for message in messages.get(role) if message.stamp] for role in roles]


def adjust_clock_rate(messages: LogMessages) -> None:
    """Convert all log times to the clock of the stamps if its rate differs, as with a simulator in slow motion."""
    anchor = max(_messages_with_stamp(messages), key=len)
    if not anchor:
        return
    log_times = np.array([message.log_time for message in anchor], dtype=np.int64)
    stamps = np.array([message.stamp for message in anchor], dtype=np.int64)
    rate = float(np.ptp(stamps)) / max(1.0, float(np.ptp(log_times)))
    is_same_clock = np.median(np.abs(stamps - log_times)) <= MAX_CLOCK_DIFFERENCE_NS
    if is_same_clock or rate < MIN_CLOCK_RATE or abs(rate - 1.0) <= MAX_CLOCK_RATE_ERROR:
        return
    messages.notes.append(f"delays of messages, because stamps advance {rate:.3f} s per second of log time")
    for role, role_messages in messages.by_role.items():
        times = np.array([message.log_time for message in role_messages], dtype=np.int64)
        converted = to_clock_of_stamps(times, log_times, stamps).tolist()
        messages.by_role[role] = [
            message._replace(log_time=time) for message, time in zip(role_messages, converted, strict=True)
        ]


def clock_offset(messages: LogMessages) -> int:
    """Return the clock of the stamps minus the clock of the log times in ns; 0 if both are the same clock."""
    stamped = _messages_with_stamp(messages)
    differences = [message.stamp - message.log_time for role_messages in stamped for message in role_messages]
    if not differences or abs(offset := max(differences)) <= MAX_CLOCK_DIFFERENCE_NS:
        return 0
    messages.notes.append("the smallest delay of messages, because stamps and log times are of different clocks")
    return offset
