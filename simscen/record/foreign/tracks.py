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
"""Minimum duration of a gap between samples, as a multiple of the median time between samples."""
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
        poses: x, y, z in m and a quaternion x, y, z, w (n, 7), in `frame`.
        covariances: xx, xy, xyaw, yy, yyaw, yawyaw (n, 6); zeros if unknown.
        twists: vx and vy in m/s, wz in rad/s (n, 3), in the frame of the base; None if a message has no twist.
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
    """Return the stamps of a topic in the order of logging; None if all stamps are zero or `options` ignore stamps."""
    if options.clock == "log" or not any(stamps):
        return None
    times = np.array(logged, dtype=np.int64)
    order = np.argsort(times, kind="stable")
    return StampedMessages(topic, times[order], np.array(stamps, dtype=np.int64)[order])


def track_from_topic(topic: str, messages: Sequence[tuple[int, StampedPose]], options: ForeignLogOptions) -> Track:
    """Return the track of a topic. `messages` are pairs of a time of logging in ns and a pose.

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
    source, logged, stamped, poses = transform_tree(decoded).track(outer, inner, use_log_time=options.clock == "log")
    return Track(source, outer, logged, stamped, poses, np.tile(NO_COVARIANCE, (len(poses), 1)), None)


def transform_tree(decoded: DecodedMessages) -> TransformTree:
    """Return all transforms of a log."""
    tree = TransformTree()
    for role in ("tf_static", "tf"):
        for logged, links in decoded.by_role[role]:
            tree.add(logged, links, is_static=role == "tf_static")
    return tree


def velocity_from_poses(ticks: Ticks, poses: Array, rate: int) -> Array:
    """Return velocities vx, vy, wz (n, 3) in the base frame for poses x, y, yaw (n, 3) at increasing `ticks` (n,).

    The velocities are averaged over at least DIFFERENCE_WINDOW_S, and over longer times where samples are sparse.
    Beside a gap, only samples on the same side are used, except if the mean speed in the gap is higher. `rate` is the
    number of ticks per second.
    """
    if len(ticks) < 2:
        return np.zeros((len(ticks), 3))
    half_window = max(1, round(DIFFERENCE_WINDOW_S / 2 * rate))
    is_gap, first, last = _parts_between_gaps(ticks, half_window)
    before = np.maximum(np.searchsorted(ticks, ticks - half_window, side="right") - 1, first)
    after = np.minimum(np.searchsorted(ticks, ticks + half_window, side="left"), last)
    unwrapped = np.column_stack((poses[:, :2], np.unwrap(poses[:, 2])))
    velocities = (unwrapped[after] - unwrapped[before]) * rate / (ticks[after] - ticks[before])[:, None]
    for index in np.flatnonzero(is_gap).tolist():
        mean = (unwrapped[index + 1] - unwrapped[index]) * rate / (ticks[index + 1] - ticks[index])
        for axes in (slice(0, 2), slice(2, 3)):
            beside_gap = velocities[index : index + 2, axes]
            if np.linalg.norm(mean[axes]) > np.linalg.norm(beside_gap, axis=1).max():
                beside_gap[:] = mean[axes]
    c, s = np.cos(poses[:, 2]), np.sin(poses[:, 2])
    vx, vy, wz = velocities.T
    return np.column_stack((c * vx + s * vy, c * vy - s * vx, wz))


def _parts_between_gaps(ticks: Ticks, min_length: int) -> tuple[npt.NDArray[np.bool_], Ticks, Ticks]:
    """Divide samples at n `ticks` into parts without a gap.

    Return a mask (n - 1,) of gaps, and for each sample the indices of the first and the last sample of its part (n,).
    For samples of a part that is shorter than `min_length` ticks, the indices are those of all samples, because the
    part is too short for a velocity.
    """
    steps = np.diff(ticks)
    is_gap: npt.NDArray[np.bool_] = steps > max(2 * min_length, MIN_GAP_PERIODS * float(np.median(steps)))
    part = np.concatenate(([0], np.cumsum(is_gap)))
    first = np.flatnonzero(np.concatenate(([True], is_gap)))[part]
    last = np.flatnonzero(np.concatenate((is_gap, [True])))[part]
    is_short = ticks[last] - ticks[first] < min_length
    return is_gap, np.where(is_short, 0, first), np.where(is_short, len(ticks) - 1, last)


def is_twist_missing(twists: Array, poses: Array) -> bool:
    """Return whether all `twists` (n, 3) are zero although the robot moved. `poses` (n, 3) are x, y, yaw."""
    distance = float(np.ptp(poses[:, 0]) + np.ptp(poses[:, 1])) if len(poses) else 0.0
    angle = float(np.abs(wrap_array(poses[:, 2] - poses[0, 2])).max()) if len(poses) else 0.0
    return not twists.any() and (distance > MIN_MOTION_M_RAD or angle > MIN_MOTION_M_RAD)
