"""Poses of bodies on scripted paths, and upper bounds of their speed and of their displacement per tick.

A segment is the part of a path between two consecutive poses. `leg` is the index of a segment.
"""

import itertools
import math
from bisect import bisect_right
from collections.abc import Sequence
from typing import NamedTuple

from simscen.core.geometry import Pose2, Pose3, wrap
from simscen.core.geometry.shapes import MotionPath

SMOOTH_PEAK_SPEED_RATIO = 1.5
"""Ratio of peak speed to mean speed of a segment with smooth easing."""
MAX_STEP_M = 0.1
"""Maximum distance that any point of a scripted body may move per tick; a faster body can pass through a robot."""
Step = tuple[float, float, float]
"""Displacement (x, y, yaw) in m and rad, or velocity in m/s and rad/s."""
_new_pose = tuple.__new__  # faster than the constructor of the class


def pose_at(path: MotionPath, seconds: float) -> Pose2:
    """Return the pose on the path, `seconds` after its start."""
    times = path.times
    if len(times) == 1:
        return path.poses[0]
    local = min(max(_fold_repetitions(path, path.elapsed(seconds)), times[0]), times[-1])
    leg = min(bisect_right(times, local), len(times) - 1) - 1
    begin, end = path.poses[leg], path.poses[leg + 1]
    duration = times[leg + 1] - times[leg]
    part = (local - times[leg]) / duration if duration > 0 else 1.0
    if path.ease == "spline":
        return _spline_pose(path, leg, part)
    if path.ease == "smooth":
        part = part * part * (3.0 - 2.0 * part)
    return Pose2(
        begin.x + part * (end.x - begin.x),
        begin.y + part * (end.y - begin.y),
        wrap(begin.yaw + part * wrap(end.yaw - begin.yaw)),
    )


class PathSampler:
    """Computes poses on a path at the height `z` (m). Fast for increasing times, because it caches the segment."""

    def __init__(self, path: MotionPath, z: float) -> None:
        self._path, self._z = path, z
        self._first, self._last = path.times[0], path.times[-1]
        self._even = len(path.times) > 1 and path.ease == "linear"
        self._once = path.mode == "once"
        self._begin, self._end = math.inf, -math.inf
        self._leg: PathSegment

    def at(self, seconds: float) -> Pose3:
        """Return the pose in space, `seconds` after the start of the path. x, y, and yaw are those of `pose_at`."""
        path, z = self._path, self._z
        if not self._even:
            return Pose3.planar(pose_at(path, seconds), z)
        running = seconds - path.start
        local = path.phase + running if running > 0 else path.phase
        if not self._once:
            local = _fold_repetitions(path, local)
        if local < self._first:
            local = self._first
        elif local > self._last:
            local = self._last
        if not self._begin <= local < self._end:
            number = min(bisect_right(path.times, local), len(path.times) - 1) - 1
            self._leg, self._begin = PathSegment.of(path, number), path.times[number]
            self._end = path.times[number + 1] if number + 2 < len(path.times) else math.inf
        begin, duration, x, y, yaw, dx, dy, turn, qz, qw = self._leg
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
    def of(cls, path: MotionPath, number: int) -> "PathSegment":
        """Return the segment from pose `number` to the next one."""
        (x, y, yaw), to = path.poses[number], path.poses[number + 1]
        begin, end = path.times[number : number + 2]
        *_, qz, qw = Pose3.planar(Pose2(x, y, wrap(yaw)))
        return cls(begin, end - begin, x, y, yaw, to.x - x, to.y - y, wrap(to.yaw - yaw), qz, qw)


def top_speed(path: MotionPath, reach: float = 0.0) -> float:
    """Return an upper bound in m/s of the speed of any point within `reach` m of the origin of the body.

    The result is inf if the path contains a jump, such as a segment without duration.
    """
    speeds = [_speed(path, leg, reach) for leg in range(len(path.times) - 1)]
    if path.mode == "loop" and _max_distance(_displacement(path.poses[-1], path.poses[0]), reach) > 0:
        return math.inf
    return max(speeds, default=0.0)


def largest_step(path: MotionPath, seconds: float, reach: float = 0.0) -> float:
    """Return an upper bound in m of the distance that a point of the body moves within a period of `seconds`.

    The point is within `reach` m of the origin of the body. Jumps do not count: segments without duration, and the
    return to the first pose in a loop.
    """
    durations = [end - begin for begin, end in itertools.pairwise(path.times)]
    lengths = [_speed(path, leg, reach) * duration if duration > 0 else 0.0 for leg, duration in enumerate(durations)]
    if path.mode == "back_and_forth":
        lengths, durations = lengths + lengths[::-1], durations + durations[::-1]
    if path.mode != "once" and (lap := sum(durations)) > 0:  # repeated, so that steps across the end count too
        laps = 2 + int(seconds / lap)
        lengths, durations = lengths * laps, durations * laps
    times = list(itertools.accumulate(durations, initial=0.0))
    distances = list(itertools.accumulate(lengths, initial=0.0))
    after = (
        _interpolate(time + seconds, times, distances) - distance
        for time, distance in zip(times, distances, strict=True)
    )
    before = (
        distance - _interpolate(time - seconds, times, distances)
        for time, distance in zip(times, distances, strict=True)
    )
    return max(*after, *before)


def too_fast_message(name: str, step: float) -> str:
    """Return the error message for a scripted body that moves `step` m in one tick."""
    return (
        f"`{name}` moves up to {step:.2g} m in one physics tick; contact with the robot can be missed if it moves more "
        f"than {MAX_STEP_M:g} m"
    )


def _interpolate(time: float, times: Sequence[float], values: Sequence[float]) -> float:
    """Return the value at `time` by linear interpolation; the first or last value outside of `times`."""
    if time <= times[0] or time >= times[-1]:
        return values[0] if time <= times[0] else values[-1]
    k = bisect_right(times, time)
    part = (time - times[k - 1]) / (times[k] - times[k - 1])
    return values[k - 1] + part * (values[k] - values[k - 1])


class SweptSegment(NamedTuple):
    """Straight line from (x, y) to (to_x, to_y), and the maximum `deviation` of a path segment from it, in m."""

    x: float
    y: float
    to_x: float
    to_y: float
    deviation: float = 0.0


def swept_segments(path: MotionPath) -> list[SweptSegment]:
    """Return a straight line for each segment of the path."""
    (x, y, _), *_ = poses = path.poses
    legs = range(len(path.times) - 1)
    return [SweptSegment(*poses[leg][:2], *poses[leg + 1][:2], _deviation(path, leg)) for leg in legs] or [
        SweptSegment(x, y, x, y)
    ]


def _deviation(path: MotionPath, leg: int) -> float:
    """Return an upper bound in m of the distance of a segment from the straight line between its ends."""
    if path.ease != "spline":
        return 0.0
    third = (path.times[leg + 1] - path.times[leg]) / 3  # a cubic curve lies in the convex hull of its control points
    return third * max(_max_distance(_spline_velocity(path, k), 0.0) for k in (leg, leg + 1))


def _speed(path: MotionPath, leg: int, reach: float) -> float:
    """Return an upper bound in m/s of the speed on a segment of any point within `reach` m of the origin."""
    step, seconds = _displacement(path.poses[leg], path.poses[leg + 1]), path.times[leg + 1] - path.times[leg]
    if path.ease == "spline":
        # The velocity along a cubic curve is a quadratic Bézier curve, which lies within its control points.
        before, after = _spline_velocity(path, leg), _spline_velocity(path, leg + 1)
        middle = [3.0 * displacement / seconds - a - b for displacement, a, b in zip(step, before, after, strict=True)]
        return max(_max_distance(velocity, reach) for velocity in (before, (middle[0], middle[1], middle[2]), after))
    meters = _max_distance(step, reach)
    if meters == 0:
        return 0.0
    return meters / seconds * (SMOOTH_PEAK_SPEED_RATIO if path.ease == "smooth" else 1.0) if seconds > 0 else math.inf


def _spline_pose(path: MotionPath, leg: int, part: float) -> Pose2:
    """Return the pose on a spline after the fraction `part` of the duration of a segment."""
    begin, end = path.poses[leg], path.poses[leg + 1]
    duration = path.times[leg + 1] - path.times[leg]
    smooth_part = part * part * (3.0 - 2.0 * part)
    leaving, arriving = part * (1.0 - part) ** 2 * duration, -(part**2) * (1.0 - part) * duration
    x, y, yaw = (
        start + smooth_part * displacement + leaving * before + arriving * after
        for start, displacement, before, after in zip(
            begin, _displacement(begin, end), _spline_velocity(path, leg), _spline_velocity(path, leg + 1), strict=True
        )
    )
    return Pose2(x, y, wrap(yaw))


def _spline_velocity(path: MotionPath, k: int) -> Step:
    """Return the velocity of a spline at pose k in m/s and rad/s (Catmull-Rom)."""
    last = len(path.poses) - 1
    if 0 < k < last:
        before, after = k - 1, k
    elif path.mode == "loop":
        before, after = last - 1, 0
    else:
        return 0.0, 0.0, 0.0
    seconds = path.times[before + 1] - path.times[before] + path.times[after + 1] - path.times[after]
    steps = [_displacement(path.poses[leg], path.poses[leg + 1]) for leg in (before, after)]
    x, y, yaw = ((a + b) / seconds for a, b in zip(*steps, strict=True))
    return x, y, yaw


def _displacement(begin: Pose2, end: Pose2) -> Step:
    return end.x - begin.x, end.y - begin.y, wrap(end.yaw - begin.yaw)


def _max_distance(step: Step, reach: float) -> float:
    """Return an upper bound in m of the distance that any point within `reach` m of the origin moves in a step."""
    return math.hypot(step[0], step[1]) + reach * abs(step[2])


def _fold_repetitions(path: MotionPath, seconds: float) -> float:
    """Convert the time on a repeated path to the time of the same pose in the first repetition."""
    first, duration = path.times[0], path.times[-1] - path.times[0]
    since = seconds - first
    if duration <= 0 or since <= 0 or path.mode == "once":
        return seconds
    if path.mode == "loop":
        return first + math.fmod(since, duration)
    phase = math.fmod(since, 2 * duration)
    return first + (phase if phase <= duration else 2 * duration - phase)
