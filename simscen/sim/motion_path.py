"""Where something on a scripted path is at a time."""

import math
from bisect import bisect_right
from itertools import pairwise

from simscen.core.geometry import Pose2, wrap
from simscen.core.shapes import MotionPath


def pose_at(path: MotionPath, seconds: float) -> Pose2:
    """The pose on the path, `seconds` after it was set off; linear between waypoints, turning the shorter way."""
    local = min(max(_local(path, seconds - path.start), path.times[0]), path.times[-1])
    if len(path.times) == 1:
        return path.poses[0]
    leg = min(bisect_right(path.times, local) - 1, len(path.times) - 2)
    begin, end = path.poses[leg], path.poses[leg + 1]
    lasts = path.times[leg + 1] - path.times[leg]
    part = (local - path.times[leg]) / lasts if lasts > 0 else 1.0
    return Pose2(
        begin.x + part * (end.x - begin.x),
        begin.y + part * (end.y - begin.y),
        wrap(begin.yaw + part * wrap(end.yaw - begin.yaw)),
    )


def top_speed(path: MotionPath, reach: float = 0.0) -> float:
    """The fastest that anything within `reach` metres of its origin ever moves, in m/s; inf where it jumps."""
    stops = list(zip(path.times, path.poses, strict=True))
    if path.mode == "loop":
        stops.append((path.times[-1], path.poses[0]))
    return max((_speed(a, b, tb - ta, reach) for (ta, a), (tb, b) in pairwise(stops)), default=0.0)


def _speed(begin: Pose2, end: Pose2, seconds: float, reach: float) -> float:
    metres = begin.distance(end) + reach * abs(wrap(end.yaw - begin.yaw))
    if metres == 0:
        return 0.0
    return metres / seconds if seconds > 0 else math.inf


def _local(path: MotionPath, seconds: float) -> float:
    """The time along the path, on its own clock."""
    first, lasts = path.times[0], path.times[-1] - path.times[0]
    since = seconds - first
    if lasts <= 0 or since <= 0 or path.mode == "once":
        return seconds
    if path.mode == "loop":
        return first + math.fmod(since, lasts)
    phase = math.fmod(since, 2 * lasts)
    return first + (phase if phase <= lasts else 2 * lasts - phase)
