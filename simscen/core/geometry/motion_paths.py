"""Poses of bodies on scripted paths, and upper bounds on the speed and the displacement of the bodies.

Segment k of a path leads from pose k to pose k + 1.
"""

import math
from bisect import bisect_right
from typing import NamedTuple

import numpy as np

from simscen.core.geometry import Pose2, Pose3, wrap
from simscen.core.geometry.shapes import MotionPath

SMOOTH_PEAK_SPEED_RATIO = 1.5
"""Ratio of the peak speed to the mean speed on a segment with smooth easing."""
MAX_STEP_M = 0.1
"""Maximum distance that a point of a scripted body may move per tick. A faster body could pass through a robot."""
XYYaw = tuple[float, float, float]
"""Displacement (x, y, yaw) in m and rad, or velocity (x, y, yaw) in m/s and rad/s, in the frame of the path."""
_new_pose = tuple.__new__  # faster than the constructor of the class


def pose_at(path: MotionPath, seconds: float) -> Pose2:
    """Return the pose on the path, `seconds` after its start."""
    times = path.times
    if len(times) == 1:
        return path.poses[0]
    local = min(max(_fold_repetitions(path, path.elapsed(seconds)), times[0]), times[-1])
    k = min(bisect_right(times, local), len(times) - 1) - 1
    begin, end = path.poses[k], path.poses[k + 1]
    duration = times[k + 1] - times[k]
    part = (local - times[k]) / duration if duration > 0 else 1.0
    if path.ease == "spline":
        return _spline_pose(path, k, part)
    if path.ease == "smooth":
        part = part * part * (3.0 - 2.0 * part)
    return Pose2(
        begin.x + part * (end.x - begin.x),
        begin.y + part * (end.y - begin.y),
        wrap(begin.yaw + part * wrap(end.yaw - begin.yaw)),
    )


class PathSampler:
    """Computes poses on a path at the height `z` (m). Fast for increasing times, because the segment is cached."""

    def __init__(self, path: MotionPath, z: float) -> None:
        self._path, self._z = path, z
        self._first, self._last = path.times[0], path.times[-1]
        self._is_linear = len(path.times) > 1 and path.ease == "linear"
        self._repeats = path.mode != "once"
        self._begin, self._end = math.inf, -math.inf
        self._segment: PathSegment

    def at(self, seconds: float) -> Pose3:
        """Return the pose in space, `seconds` after the start of the path. x, y, and yaw are as in `pose_at`."""
        path, z = self._path, self._z
        if not self._is_linear:
            return Pose3.planar(pose_at(path, seconds), z)
        running = seconds - path.start
        local = path.phase + running if running > 0 else path.phase
        if self._repeats:
            local = _fold_repetitions(path, local)
        if local < self._first:
            local = self._first
        elif local > self._last:
            local = self._last
        if not self._begin <= local < self._end:
            k = min(bisect_right(path.times, local), len(path.times) - 1) - 1
            self._segment, self._begin = PathSegment.of(path, k), path.times[k]
            self._end = path.times[k + 1] if k + 2 < len(path.times) else math.inf
        begin, duration, x, y, yaw, dx, dy, turn, qz, qw = self._segment
        part = (local - begin) / duration if duration > 0 else 1.0
        x, y = x + part * dx, y + part * dy
        if turn:
            return Pose3.planar(Pose2(x, y, wrap(yaw + part * turn)), z)
        return _new_pose(Pose3, (x, y, z, 0.0, 0.0, qz, qw))


class PathSegment(NamedTuple):
    """Segment between two poses of a path.

    `begin` and `duration` are in s of path time. `x`, `y` and `yaw` are the start pose. `dx`, `dy` (m), and `turn`
    (rad) are the displacement over the whole segment. `qz` and `qw` are the quaternion of the start pose.
    """

    begin: float
    duration: float
    x: float
    y: float
    yaw: float
    dx: float
    dy: float
    turn: float
    qz: float
    qw: float

    @classmethod
    def of(cls, path: MotionPath, k: int) -> "PathSegment":
        """Return segment k of a path."""
        (x, y, yaw), to = path.poses[k], path.poses[k + 1]
        begin, end = path.times[k : k + 2]
        *_, qz, qw = Pose3.planar(Pose2(x, y, wrap(yaw)))
        return cls(begin, end - begin, x, y, yaw, to.x - x, to.y - y, wrap(to.yaw - yaw), qz, qw)


def top_speed(path: MotionPath, reach: float = 0.0) -> float:
    """Return an upper bound in m/s on the speed of any point within `reach` m of the origin of the body.

    The result is inf if the path contains a jump, such as a segment without duration.
    """
    speeds = [_speed(path, k, reach) for k in range(len(path.times) - 1)]
    if path.mode == "loop" and _max_distance(_displacement(path.poses[-1], path.poses[0]), reach) > 0:
        return math.inf
    return max(speeds, default=0.0)


def largest_step(path: MotionPath, seconds: float, reach: float = 0.0) -> float:
    """Return an upper bound in m on the distance that a point of the body moves in any period of `seconds`.

    The point is within `reach` m of the origin of the body. Jumps do not count: segments without duration, and the
    return to the first pose in a loop.
    """
    durations = np.diff(path.times)
    lengths = np.array(
        [_speed(path, k, reach) * duration if duration > 0 else 0.0 for k, duration in enumerate(durations.tolist())]
    )
    if path.mode == "back_and_forth":
        lengths, durations = np.append(lengths, lengths[::-1]), np.append(durations, durations[::-1])
    if path.mode != "once" and (lap := durations.sum()) > 0:  # repeated, so that steps across the end count too
        laps = 2 + int(seconds / lap)
        lengths, durations = np.tile(lengths, laps), np.tile(durations, laps)
    times, distances = np.append(0.0, np.cumsum(durations)), np.append(0.0, np.cumsum(lengths))
    after = np.interp(times + seconds, times, distances) - distances
    before = distances - np.interp(times - seconds, times, distances)
    return float(max(after.max(), before.max()))


def too_fast_message(name: str, step: float) -> str:
    """Return the error message for a scripted body that moves `step` m in one tick."""
    return (
        f"`{name}` moves up to {step:.2g} m in one physics tick; contact with the robot can be missed if it moves more "
        f"than {MAX_STEP_M:g} m"
    )


class SweptSegment(NamedTuple):
    """Straight line from (x, y) to (to_x, to_y), the ends of a path segment.

    The distance of the path segment from the line is at most `deviation`. All values are in m.
    """

    x: float
    y: float
    to_x: float
    to_y: float
    deviation: float = 0.0


def swept_segments(path: MotionPath) -> list[SweptSegment]:
    """Return the straight line between the ends of each segment; a line without length for a path with one pose."""
    (x, y, _), *_ = poses = path.poses
    segments = range(len(path.times) - 1)
    return [SweptSegment(*poses[k][:2], *poses[k + 1][:2], _deviation(path, k)) for k in segments] or [
        SweptSegment(x, y, x, y)
    ]


def _deviation(path: MotionPath, k: int) -> float:
    """Return an upper bound in m on the distance of segment k from the straight line between its ends."""
    if path.ease != "spline":
        return 0.0
    third = (path.times[k + 1] - path.times[k]) / 3  # a cubic curve lies in the convex hull of its control points
    return third * max(_max_distance(_spline_velocity(path, pose), 0.0) for pose in (k, k + 1))


def _speed(path: MotionPath, k: int, reach: float) -> float:
    """Return an upper bound in m/s on the speed of any point within `reach` m of the origin on segment k."""
    step, seconds = _displacement(path.poses[k], path.poses[k + 1]), path.times[k + 1] - path.times[k]
    if path.ease == "spline":
        # The velocity along a cubic curve is a quadratic Bézier curve, which lies within its control points.
        before, after = _spline_velocity(path, k), _spline_velocity(path, k + 1)
        middle = [3.0 * displacement / seconds - a - b for displacement, a, b in zip(step, before, after, strict=True)]
        return max(_max_distance(velocity, reach) for velocity in (before, (middle[0], middle[1], middle[2]), after))
    meters = _max_distance(step, reach)
    if meters == 0:
        return 0.0
    return meters / seconds * (SMOOTH_PEAK_SPEED_RATIO if path.ease == "smooth" else 1.0) if seconds > 0 else math.inf


def _spline_pose(path: MotionPath, k: int, part: float) -> Pose2:
    """Return the pose on a spline after the fraction `part` of the duration of segment k."""
    begin, end = path.poses[k], path.poses[k + 1]
    duration = path.times[k + 1] - path.times[k]
    smooth_part = part * part * (3.0 - 2.0 * part)
    leaving, arriving = part * (1.0 - part) ** 2 * duration, -(part**2) * (1.0 - part) * duration
    x, y, yaw = (
        start + smooth_part * displacement + leaving * before + arriving * after
        for start, displacement, before, after in zip(
            begin, _displacement(begin, end), _spline_velocity(path, k), _spline_velocity(path, k + 1), strict=True
        )
    )
    return Pose2(x, y, wrap(yaw))


def _spline_velocity(path: MotionPath, k: int) -> XYYaw:
    """Return the velocity of a spline at pose k in m/s and rad/s (Catmull-Rom); zero at both ends, except in a loop."""
    last = len(path.poses) - 1
    if 0 < k < last:
        before, after = k - 1, k
    elif path.mode == "loop":
        before, after = last - 1, 0
    else:
        return 0.0, 0.0, 0.0
    seconds = path.times[before + 1] - path.times[before] + path.times[after + 1] - path.times[after]
    steps = [_displacement(path.poses[k], path.poses[k + 1]) for k in (before, after)]
    x, y, yaw = ((a + b) / seconds for a, b in zip(*steps, strict=True))
    return x, y, yaw


def _displacement(begin: Pose2, end: Pose2) -> XYYaw:
    """Return the displacement from one pose to another, by the shorter rotation."""
    return end.x - begin.x, end.y - begin.y, wrap(end.yaw - begin.yaw)


def _max_distance(step: XYYaw, reach: float) -> float:
    """Return an upper bound in m on how far a displacement moves any point within `reach` m of the origin."""
    return math.hypot(step[0], step[1]) + reach * abs(step[2])


def _fold_repetitions(path: MotionPath, seconds: float) -> float:
    """Return the path time within the first pass at which the pose is the same as at the path time `seconds`."""
    first, duration = path.times[0], path.times[-1] - path.times[0]
    elapsed = seconds - first
    if duration <= 0 or elapsed <= 0 or path.mode == "once":
        return seconds
    if path.mode == "loop":
        return first + math.fmod(elapsed, duration)
    phase = math.fmod(elapsed, 2 * duration)
    return first + (phase if phase <= duration else 2 * duration - phase)
