"""Decoding of the messages of a real log by their role, and tracks: sequences of poses of the robot."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from simscen.core.geometry import Array, wrap_array
from simscen.core.records.trace import Ticks
from simscen.record.foreign.options import TOPICS, ForeignLogOptions
from simscen.record.foreign.raw_messages import RawMessage, UnusableLog
from simscen.record.foreign.timebase import StampedMessages, check_recorder_clock
from simscen.record.foreign.transforms import TransformTree
from simscen.record.messages import decode
from simscen.record.messages.decode import NO_COVARIANCE, CheckedReader, StampedPose, decode_checked

DIFFERENCE_WINDOW_S = 0.2
"""Time over which velocities are computed from poses. Poses of motion capture have a noise of some millimeters."""
MIN_MOTION_M_RAD = 0.1
"""Motion in m or rad from which an odometry with zero twists counts as one without twists."""

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
"""Decoders by role and message type. Only the stamps of scans are decoded."""


@dataclass
class DecodedMessages:
    """Messages by role with their times of logging, and the reasons why a role has no messages."""

    by_role: dict[str, list[tuple[int, Any]]] = field(default_factory=lambda: defaultdict(list))
    problems: dict[str, str] = field(default_factory=dict)


def topic_roles(options: ForeignLogOptions) -> dict[str, list[str]]:
    """Return the roles of each topic. The topic of the ground truth can have another role, too."""
    roles: dict[str, list[str]] = defaultdict(list)
    for role in TOPICS:
        roles[options.topic(role)].append(role)
    if options.truth is not None and options.frames is None:
        roles[options.truth].append("truth")
    return dict(roles)


def decode_messages(raw: Iterable[RawMessage], roles: Mapping[str, Sequence[str]]) -> DecodedMessages:
    """Decode the messages of topics with roles. Raises UnusableLog for a message that does not match its type."""
    decoded = DecodedMessages()
    for message in raw:
        for role in roles.get(message.topic, ()):
            _decode(decoded, role, message)
    return decoded


def _decode(decoded: DecodedMessages, role: str, message: RawMessage) -> None:
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


@dataclass(frozen=True, eq=False)
class Track:
    """Poses (n, 7) in `frame` in the order of logging, with covariances (n, 6).

    `source` is a topic or two frames. `twists` (n, 3) is None if a message has none. `stamped` is None if the times of
    logging are used.
    """

    source: str
    frame: str
    logged: Ticks
    stamped: StampedMessages | None
    poses: Array
    covariances: Array
    twists: Array | None


def stamped_messages(
    topic: str, logged: Sequence[int], stamps: Sequence[int], options: ForeignLogOptions
) -> StampedMessages | None:
    """Return the stamps of a topic by time of logging, or None if they are never set or not to be used."""
    if options.clock == "log" or not any(stamps):
        return None
    times = np.array(logged, dtype=np.int64)
    order = np.argsort(times, kind="stable")
    return StampedMessages(topic, times[order], np.array(stamps, dtype=np.int64)[order])


def track_from_topic(topic: str, messages: Sequence[tuple[int, StampedPose]], options: ForeignLogOptions) -> Track:
    """Return the track of a topic. Raises UnusableLog if its messages have several frames."""
    frames = sorted({pose.frame for _, pose in messages})
    if len(frames) > 1:
        raise UnusableLog(f"{topic} has messages in several frames: {', '.join(frames)}")
    check_recorder_clock(topic, [time for time, _ in messages], [pose.stamp for _, pose in messages])
    messages = sorted(messages, key=lambda message: message[0])
    logged, poses = [time for time, _ in messages], [pose for _, pose in messages]
    twists = [pose.twist for pose in poses if pose.twist is not None]
    return Track(
        topic,
        frames[0],
        np.array(logged, dtype=np.int64),
        stamped_messages(topic, logged, [pose.stamp for pose in poses], options),
        np.array([pose.pose for pose in poses]),
        np.array([pose.covariance for pose in poses]),
        np.array(twists) if len(twists) == len(messages) else None,
    )


def track_from_tf(outer: str, inner: str, decoded: DecodedMessages, options: ForeignLogOptions) -> Track | str:
    """Return the track of the frame `inner` in `outer` from tf, or the reason why there is none."""
    tree = TransformTree()
    for role in ("tf_static", "tf"):
        for logged, links in decoded.by_role[role]:
            tree.add(logged, links, static=role == "tf_static")
    result = tree.between(outer, inner)
    if isinstance(result, str):
        return result
    times, poses = result
    covariances = np.tile(NO_COVARIANCE, (len(poses), 1))
    stamped = None if options.clock == "log" or not times.stamps.any() else times
    return Track(times.topic, outer, times.logged, stamped, poses, covariances, None)


def velocity_from_poses(ticks: Ticks, poses: Array, rate: int) -> Array:
    """Return vx, vy, wz (n, 3) in the body frame for poses x, y, yaw (n, 3), averaged over DIFFERENCE_WINDOW_S."""
    if len(ticks) < 2:
        return np.zeros((len(ticks), 3))
    half = max(1, round(DIFFERENCE_WINDOW_S / 2 * rate))
    before = np.searchsorted(ticks, ticks - half, side="right") - 1
    after = np.searchsorted(ticks, ticks + half, side="left")
    before, after = np.maximum(before, 0), np.minimum(after, len(ticks) - 1)
    span = (ticks[after] - ticks[before]) / rate
    dx, dy = ((poses[after, axis] - poses[before, axis]) / span for axis in (0, 1))
    unwrapped = np.unwrap(poses[:, 2])
    wz = (unwrapped[after] - unwrapped[before]) / span
    c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    return np.column_stack((c * dx + s * dy, c * dy - s * dx, wz))


def is_twist_missing(twists: Array, poses: Array) -> bool:
    """Return whether the twists of an odometry were never set: always zero although the robot moved."""
    moved = float(np.ptp(poses[:, 0]) + np.ptp(poses[:, 1])) if len(poses) else 0.0
    turned = float(np.abs(wrap_array(poses[:, 2] - poses[0, 2])).max()) if len(poses) else 0.0
    return not twists.any() and (moved > MIN_MOTION_M_RAD or turned > MIN_MOTION_M_RAD)
