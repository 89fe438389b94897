"""How fast a robot went whose log says only where it was."""

from __future__ import annotations

import struct
from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from simscen.core.geometry import Array, wrap_array
from simscen.core.records.trace import Ticks
from simscen.record.foreign import messages
from simscen.record.foreign.messages import NO_COVARIANCE, StampedPose
from simscen.record.foreign.options import TOPICS, ForeignLogOptions
from simscen.record.foreign.raw_messages import RawMessage, UnusableLog
from simscen.record.foreign.timebase import StampedMessages
from simscen.record.foreign.transforms import TransformTree

DIFFERENCE_WINDOW_S = 0.2
"""Seconds over which a difference of positions becomes a velocity: a motion capture trembles by millimeters."""
MIN_MOTION_M = 0.1
"""Meters: what moved further has a velocity that is not zero all the time."""


def velocity_from_poses(ticks: Ticks, poses: Array, rate: int) -> Array:
    """vx, vy, wz (n, 3) in the body's frame from x, y, yaw (n, 3), averaged over about SPAN seconds around each."""
    if len(ticks) < 2:
        return np.zeros((len(ticks), 3))
    half = max(1, round(DIFFERENCE_WINDOW_S / 2 * rate))
    before = np.searchsorted(ticks, ticks - half, side="right") - 1
    after = np.searchsorted(ticks, ticks + half, side="left")
    before, after = np.maximum(before, 0), np.minimum(after, len(ticks) - 1)
    span = (ticks[after] - ticks[before]) / rate
    dx, dy = ((poses[after, axis] - poses[before, axis]) / span for axis in (0, 1))
    unwrapped = np.unwrap(poses[:, 2])
    turn = (unwrapped[after] - unwrapped[before]) / span
    c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    return np.column_stack((c * dx + s * dy, c * dy - s * dx, turn))


def is_twist_missing(twists: Array, poses: Array) -> bool:
    """Whether an odometry's twist was never filled in: zero all the time though the robot moved."""
    far = float(np.ptp(poses[:, 0]) + np.ptp(poses[:, 1])) if len(poses) else 0.0
    turned = float(np.abs(wrap_array(poses[:, 2] - poses[0, 2])).max()) if len(poses) else 0.0
    return not twists.any() and (far > MIN_MOTION_M or turned > MIN_MOTION_M)


_READERS: dict[str, dict[str, Callable[[bytes], Any]]] = {
    "truth": dict(messages.POSES),
    "odom": {"nav_msgs/msg/Odometry": messages.odometry},
    "amcl_pose": dict(messages.POSES),
    "scan": {"sensor_msgs/msg/LaserScan": messages.scan_stamp},
    "cmd_vel": {
        "geometry_msgs/msg/Twist": messages.twist,
        "geometry_msgs/msg/TwistStamped": messages.twist_stamped,
    },
    "plan": {"nav_msgs/msg/Path": messages.path},
    "tf": {"tf2_msgs/msg/TFMessage": messages.transforms},
    "tf_static": {"tf2_msgs/msg/TFMessage": messages.transforms},
    "status": {"action_msgs/msg/GoalStatusArray": messages.goal_states},
}


@dataclass
class DecodedMessages:
    """What was read: for each role when it was logged and what it says; why a role has nothing (`lacking`)."""

    said: dict[str, list[tuple[int, Any]]] = field(default_factory=lambda: defaultdict(list))
    lacking: dict[str, str] = field(default_factory=dict)


def topic_roles(wanted: ForeignLogOptions) -> dict[str, list[str]]:
    """What each topic that is wanted stands for; the truth may be a topic that stands for something else, too."""
    roles: dict[str, list[str]] = defaultdict(list)
    for role in TOPICS:
        roles[wanted.topic(role)].append(role)
    if wanted.truth is not None and wanted.frames is None:
        roles[wanted.truth].append("truth")
    return dict(roles)


def decode_messages(raw: Iterable[RawMessage], roles: Mapping[str, Sequence[str]]) -> DecodedMessages:
    """Read the messages of these topics. Raises Unusable for one that is not of its type."""
    found = DecodedMessages()
    for message in raw:
        for role in roles.get(message.topic, ()):
            _take(found, role, message)
    return found


def _take(found: DecodedMessages, role: str, message: RawMessage) -> None:
    readers = _READERS[role]
    if message.encoding != "cdr":
        found.lacking[role] = f"{message.topic} is encoded as {message.encoding or 'something unknown'}, not as CDR"
        return
    if message.type not in readers:
        expected = " or ".join(readers)
        found.lacking[role] = f"{message.topic} is a {message.type or 'type without a name'}, expected {expected}"
        return
    try:
        found.said[role].append((message.time, readers[message.type](message.data)))
    except (struct.error, ValueError, UnicodeDecodeError, OverflowError) as error:
        number = len(found.said[role]) + 1
        raise UnusableLog(f"message {number} of {message.topic} cannot be read as {message.type}: {error}") from error


@dataclass(frozen=True, eq=False)
class Track:
    """Poses (n, 7) in `frame`, in the order they were logged, with covariances (n, 6) and perhaps twists (n, 3)."""

    source: str
    frame: str
    logged: Ticks
    stamped: StampedMessages | None
    poses: Array
    covariances: Array
    twists: Array | None


def stamped_messages(
    topic: str, logged: Sequence[int], stamps: Sequence[int], wanted: ForeignLogOptions
) -> StampedMessages | None:
    """The stamps of a topic's messages by the time of logging; None where they are not to be used, or never set."""
    if wanted.clock == "log" or not any(stamps):
        return None
    times = np.array(logged, dtype=np.int64)
    order = np.argsort(times, kind="stable")
    return StampedMessages(topic, times[order], np.array(stamps, dtype=np.int64)[order])


def track_from_topic(topic: str, said: Sequence[tuple[int, StampedPose]], wanted: ForeignLogOptions) -> Track:
    """The track that a topic's messages make. Raises Unusable when they are told in several frames."""
    frames = sorted({posed.frame for _, posed in said})
    if len(frames) > 1:
        raise UnusableLog(f"{topic} is told in several frames: {', '.join(frames)}")
    said = sorted(said, key=lambda one: one[0])
    logged = [time for time, _ in said]
    twists = [posed.twist for _, posed in said if posed.twist is not None]
    return Track(
        topic,
        frames[0],
        np.array(logged, dtype=np.int64),
        stamped_messages(topic, logged, [posed.stamp for _, posed in said], wanted),
        np.array([posed.pose for _, posed in said]),
        np.array([posed.covariance for _, posed in said]),
        np.array(twists) if len(twists) == len(said) else None,
    )


def track_from_tf(outer: str, inner: str, found: DecodedMessages, wanted: ForeignLogOptions) -> Track | str:
    """The track that tf makes of the frame `inner` in `outer`; or why there is none."""
    tree = TransformTree()
    for role in ("tf_static", "tf"):
        for logged, links in found.said[role]:
            tree.add(logged, links, static=role == "tf_static")
    between = tree.between(outer, inner)
    if isinstance(between, str):
        return between
    told, poses = between
    covariances = np.tile(NO_COVARIANCE, (len(poses), 1))
    by_stamp = None if wanted.clock == "log" or not told.stamps.any() else told
    return Track(told.topic, outer, told.logged, by_stamp, poses, covariances, None)
