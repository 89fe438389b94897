"""Where something on a scripted path is at a time."""

import math
from bisect import bisect_right

from simscen.core.geometry import Pose2, Pose3, wrap
from simscen.core.shapes import MotionPath

FASTEST_EASED = 1.5
"""How much faster than evenly something is in the middle of a way that it is eased along."""
Step = tuple[float, float, float]
_made = tuple.__new__  # a pose without the calls of its class


def pose_at(path: MotionPath, seconds: float) -> Pose2:
    """The pose on the path, `seconds` after it was set off."""
    times = path.times
    if len(times) == 1:
        return path.poses[0]
    local = min(max(_local(path, path.elapsed(seconds)), times[0]), times[-1])
    leg = min(bisect_right(times, local), len(times) - 1) - 1
    begin, end = path.poses[leg], path.poses[leg + 1]
    lasts = times[leg + 1] - times[leg]
    part = (local - times[leg]) / lasts if lasts > 0 else 1.0
    if path.ease == "spline":
        return _on_curve(path, leg, part)
    if path.ease == "smooth":
        part = part * part * (3.0 - 2.0 * part)
    return Pose2(
        begin.x + part * (end.x - begin.x),
        begin.y + part * (end.y - begin.y),
        wrap(begin.yaw + part * wrap(end.yaw - begin.yaw)),
    )


class Track:
    """A path at a height `z`, asked at one time after the other: what is the same along a leg is worked out once."""

    def __init__(self, path: MotionPath, z: float) -> None:
        self._path, self._z = path, z
        self._first, self._last = path.times[0], path.times[-1]
        self._even = len(path.times) > 1 and path.ease == "linear"
        self._once = path.mode == "once"
        self._begin, self._end = math.inf, -math.inf

    def at(self, seconds: float) -> Pose3:
        """`pose_at`, upright in space."""
        path, z = self._path, self._z
        if not self._even:
            return Pose3.planar(pose_at(path, seconds), z)
        running = seconds - path.start
        local = path.phase + running if running > 0 else path.phase
        if not self._once:
            local = _local(path, local)
        if local < self._first:
            local = self._first
        elif local > self._last:
            local = self._last
        if not self._begin <= local < self._end:
            self._enter(local)
        part = (local - self._begin) / self._lasts if self._lasts > 0 else 1.0
        (x, y, yaw), turn = self._pose, self._turn
        x, y = x + part * self._dx, y + part * self._dy
        if turn:
            return Pose3.planar(Pose2(x, y, wrap(yaw + part * turn)), z)
        return _made(Pose3, (x, y, z, 0.0, 0.0, self._qz, self._qw))

    def _enter(self, local: float) -> None:
        path, last = self._path, len(self._path.times) - 1
        leg = min(bisect_right(path.times, local), last) - 1
        self._begin, end = path.times[leg], path.times[leg + 1]
        self._lasts, self._end = end - self._begin, end if leg + 1 < last else math.inf
        self._pose = begin = path.poses[leg]
        to = path.poses[leg + 1]
        self._dx, self._dy, self._turn = to.x - begin.x, to.y - begin.y, wrap(to.yaw - begin.yaw)
        *_, self._qz, self._qw = Pose3.planar(Pose2(begin.x, begin.y, wrap(begin.yaw)))


def top_speed(path: MotionPath, reach: float = 0.0) -> float:
    """A speed in m/s that nothing within `reach` metres of its origin ever exceeds; inf where it jumps.

    It is the fastest that something eased or even ever moves, and no less for a spline.
    """
    speeds = [_speed(path, leg, reach) for leg in range(len(path.times) - 1)]
    if path.mode == "loop" and _metres(_step(path.poses[-1], path.poses[0]), reach) > 0:
        return math.inf
    return max(speeds, default=0.0)


def _speed(path: MotionPath, leg: int, reach: float) -> float:
    step, seconds = _step(path.poses[leg], path.poses[leg + 1]), path.times[leg + 1] - path.times[leg]
    if path.ease == "spline":
        # The velocity along a cubic curve is a quadratic Bézier curve, which lies within its control points.
        before, after = _velocity(path, leg), _velocity(path, leg + 1)
        middle = [3.0 * way / seconds - a - b for way, a, b in zip(step, before, after, strict=True)]
        return max(_metres(velocity, reach) for velocity in (before, (middle[0], middle[1], middle[2]), after))
    metres = _metres(step, reach)
    if metres == 0:
        return 0.0
    return metres / seconds * (FASTEST_EASED if path.ease == "smooth" else 1.0) if seconds > 0 else math.inf


def _on_curve(path: MotionPath, leg: int, part: float) -> Pose2:
    begin, end = path.poses[leg], path.poses[leg + 1]
    lasts = path.times[leg + 1] - path.times[leg]
    risen = part * part * (3.0 - 2.0 * part)
    leaving, arriving = part * (1.0 - part) ** 2 * lasts, -(part**2) * (1.0 - part) * lasts
    x, y, yaw = (
        here + risen * way + leaving * before + arriving * after
        for here, way, before, after in zip(
            begin, _step(begin, end), _velocity(path, leg), _velocity(path, leg + 1), strict=True
        )
    )
    return Pose2(x, y, wrap(yaw))


def _velocity(path: MotionPath, k: int) -> Step:
    """The velocity of a spline at pose k, in m/s and rad/s."""
    last = len(path.poses) - 1
    if 0 < k < last:
        before, after = k - 1, k
    elif path.mode == "loop":
        before, after = last - 1, 0
    else:
        return 0.0, 0.0, 0.0
    seconds = path.times[before + 1] - path.times[before] + path.times[after + 1] - path.times[after]
    ways = [_step(path.poses[leg], path.poses[leg + 1]) for leg in (before, after)]
    x, y, yaw = ((a + b) / seconds for a, b in zip(*ways, strict=True))
    return x, y, yaw


def _step(begin: Pose2, end: Pose2) -> Step:
    return end.x - begin.x, end.y - begin.y, wrap(end.yaw - begin.yaw)


def _metres(step: Step, reach: float) -> float:
    return math.hypot(step[0], step[1]) + reach * abs(step[2])


def _local(path: MotionPath, seconds: float) -> float:
    """Where on the path it is, as a time of `times`."""
    first, lasts = path.times[0], path.times[-1] - path.times[0]
    since = seconds - first
    if lasts <= 0 or since <= 0 or path.mode == "once":
        return seconds
    if path.mode == "loop":
        return first + math.fmod(since, lasts)
    phase = math.fmod(since, 2 * lasts)
    return first + (phase if phase <= lasts else 2 * lasts - phase)
