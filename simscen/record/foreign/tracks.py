"""Tracks (poses of a robot over time) from a topic or from tf in a real robot's log."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, wrap_array
from simscen.core.records.trace import Ticks
from simscen.record.foreign.decoded_messages import DecodedMessages
from simscen.record.foreign.options import ForeignLogOptions
from simscen.record.foreign.raw_messages import UnusableLog
from simscen.record.foreign.timebase import StampedMessages, check_recorder_clock
from simscen.record.foreign.transforms import TransformTree
from simscen.record.messages.decode import NO_COVARIANCE, StampedPose

DIFFERENCE_WINDOW_S = 0.2
"""Time over which velocities are computed from poses."""
MIN_GAP_PERIODS = 3.0
"""Minimum time without a sample, in median times between samples, that is a gap."""
MIN_MOTION_M_RAD = 0.1
"""Motion in m or rad above which twists of zero count as missing."""


@dataclass(frozen=True, eq=False)
class Track:
    """Poses of the robot over time, in the order of logging.

    Attributes:
        source: Topic or pair of frames, for messages to the user.
        frame: Frame of the poses.
        logged: Times of logging (n,) in ns.
        stamped: Stamps; None if the times of logging are used instead.
        poses: x, y, z and a quaternion x, y, z, w (n, 7).
        covariances: xx, xy, xyaw, yy, yyaw, yawyaw (n, 6); zeros if unknown.
        twists: vx, vy, wz (n, 3); None if a message has no twist.
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
    """Return the stamps of a topic by time of logging; None if all stamps are zero or `options` ignore stamps."""
    if options.clock == "log" or not any(stamps):
        return None
    times = np.array(logged, dtype=np.int64)
    order = np.argsort(times, kind="stable")
    return StampedMessages(topic, times[order], np.array(stamps, dtype=np.int64)[order])


def track_from_topic(topic: str, messages: Sequence[tuple[int, StampedPose]], options: ForeignLogOptions) -> Track:
    """Return the track of a topic. `messages` are times of logging in ns and poses.

    Raises UnusableLog if the messages have several frames or if a clock was set during the recording.
    """
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


def track_from_tf(outer: str, inner: str, decoded: DecodedMessages, options: ForeignLogOptions) -> Track:
    """Return the track of the frame `inner` in the frame `outer` from tf. Raises UnknownTransform, or UnusableLog."""
    source, times, stamped, poses = transform_tree(decoded).between(outer, inner, use_log_time=options.clock == "log")
    return Track(source, outer, times, stamped, poses, np.tile(NO_COVARIANCE, (len(poses), 1)), None)


def transform_tree(decoded: DecodedMessages) -> TransformTree:
    """Return all transforms of a log."""
    tree = TransformTree()
    for role in ("tf_static", "tf"):
        for logged, links in decoded.by_role[role]:
            tree.add(logged, links, is_static=role == "tf_static")
    return tree


def velocity_from_poses(ticks: Ticks, poses: Array, rate: int) -> Array:
    """Return vx, vy, wz (n, 3) in the body frame for poses x, y, yaw (n, 3) at increasing `ticks` (n,).

    They are averaged over at least DIFFERENCE_WINDOW_S, and over longer times where samples are sparse. Beside a gap,
    only samples on the same side are used, unless the robot moved faster in the gap.
    """
    if len(ticks) < 2:
        return np.zeros((len(ticks), 3))
    half = max(1, round(DIFFERENCE_WINDOW_S / 2 * rate))
    is_gap, first, last = _parts_between_gaps(ticks, half)
    before = np.maximum(np.searchsorted(ticks, ticks - half, side="right") - 1, first)
    after = np.minimum(np.searchsorted(ticks, ticks + half, side="left"), last)
    moved = np.column_stack((poses[:, :2], np.unwrap(poses[:, 2])))
    velocities = (moved[after] - moved[before]) * rate / (ticks[after] - ticks[before])[:, None]
    for index in np.flatnonzero(is_gap).tolist():
        mean = (moved[index + 1] - moved[index]) * rate / (ticks[index + 1] - ticks[index])
        for part in (slice(0, 2), slice(2, 3)):
            beside = velocities[index : index + 2, part]
            if np.linalg.norm(mean[part]) > np.linalg.norm(beside, axis=1).max():
                beside[:] = mean[part]
    c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    vx, vy, wz = velocities.T
    return np.column_stack((c * vx + s * vy, c * vy - s * vx, wz))


def _parts_between_gaps(ticks: Ticks, min_length: int) -> tuple[npt.NDArray[np.bool_], Ticks, Ticks]:
    """Return a mask (n - 1,) of gaps, and the first and the last sample (n,) between the gaps beside each sample.

    Parts shorter than `min_length` ticks have too few samples for a velocity. For their samples, all gaps are ignored.
    """
    steps = np.diff(ticks)
    is_gap: npt.NDArray[np.bool_] = steps > max(2 * min_length, MIN_GAP_PERIODS * float(np.median(steps)))
    part = np.concatenate(([0], np.cumsum(is_gap)))
    first = np.flatnonzero(np.concatenate(([True], is_gap)))[part]
    last = np.flatnonzero(np.concatenate((is_gap, [True])))[part]
    is_short = ticks[last] - ticks[first] < min_length
    return is_gap, np.where(is_short, 0, first), np.where(is_short, len(ticks) - 1, last)


def is_twist_missing(twists: Array, poses: Array) -> bool:
    """Return whether all twists are zero although the robot moved."""
    moved = float(np.ptp(poses[:, 0]) + np.ptp(poses[:, 1])) if len(poses) else 0.0
    turned = float(np.abs(wrap_array(poses[:, 2] - poses[0, 2])).max()) if len(poses) else 0.0
    return not twists.any() and (moved > MIN_MOTION_M_RAD or turned > MIN_MOTION_M_RAD)
