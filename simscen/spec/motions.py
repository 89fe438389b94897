"""Specification of scripted motions."""

from __future__ import annotations

import itertools
import math
from typing import Annotated, Literal, NamedTuple

from pydantic import AfterValidator, Field, model_validator

from simscen.core.geometry import Pose2, wrap
from simscen.core.geometry.shapes import MotionPath
from simscen.spec.base import Spec
from simscen.spec.places import PlaceOrPoint
from simscen.spec.quantities import Angle, Duration, Length, PositiveSpeed

CORNER_TURN_S = 0.25
"""Half of the duration of a turn at a corner, at most. In motions without stops, it is also at most a quarter of the
duration of the leg."""
SMOOTH_DURATION_FACTOR = 1.5
"""Duration of a leg with `ease: smooth`, divided by its duration at constant top speed."""
LOOP_TOLERANCE_M_RAD = 1e-6
"""Maximum distance in m, and maximum yaw difference in rad, between the first and the last keyframe of a loop."""

Keyframe = Annotated[tuple[Duration, Length, Length, Angle], Field(strict=False)]
"""Time in s, x and y in m, and yaw in rad. In YAML, it is a list."""


def _check_times(keyframes: list[tuple[float, float, float, float]]) -> list[tuple[float, float, float, float]]:
    for before, after in itertools.pairwise(keyframes):
        if after[0] <= before[0]:
            raise ValueError(f"the times of keyframes must rise, but {after[0]:g} s comes after {before[0]:g} s")
    return keyframes


class Motion(Spec):
    """A scripted motion along waypoints at a speed, or through timed keyframes."""

    through: Annotated[list[PlaceOrPoint], Field(min_length=1, max_length=1000)] | None = None
    """Waypoints after the current position: [x, y] in the world frame, or names of places. The object moves along
    straight lines and faces its direction of motion."""
    speed: PositiveSpeed | None = None
    """Speed between waypoints; with `ease: smooth`, the top speed."""
    keyframes: Annotated[list[Keyframe], Field(min_length=1, max_length=1000), AfterValidator(_check_times)] | None = (
        None
    )
    """Timed poses instead of waypoints: [t, x, y, yaw] in the world frame, with t from the start of the motion. With a
    keyframe at time 0, the object starts there; otherwise, it moves from its current pose to the first keyframe. Turns
    take the shorter direction."""
    repeat: Literal["once", "loop", "back_and_forth"] = "once"
    """Behavior at the end: stop, start over, or move backward along the path. A loop through waypoints returns to its
    start; a loop of keyframes must end at its first keyframe."""
    ease: Literal["linear", "smooth", "spline"] = "linear"
    """Velocity profile. `linear`: constant speed between waypoints or keyframes. `smooth`: a stop at each waypoint or
    keyframe; after a fraction u of the time for a leg, the object has covered 3u² - 2u³ of the leg (peak speed 1.5
    times the mean). `spline`: through keyframes without stopping, along a cubic Hermite curve; at rest at both ends,
    except in a loop. The velocity at a keyframe is the Catmull-Rom velocity for uneven times: (next pose - previous
    pose) / (next time - previous time)."""
    phase: Duration = 0.0
    """Time of the keyframes at which the motion starts, so that several objects can share keyframes."""

    @model_validator(mode="after")
    def _check_kind(self) -> Motion:
        if (self.through is None) == (self.keyframes is None):
            raise ValueError("expected through and speed, or keyframes")
        if (self.through is None) != (self.speed is None):
            raise ValueError("expected speed along waypoints" if self.through else "keyframes have times, and no speed")
        if self.through is not None and self.ease == "spline":
            raise ValueError("`ease: spline` needs keyframes instead of waypoints and speed")
        if self.through is not None and self.phase:
            raise ValueError("`phase` needs keyframes instead of waypoints and speed")
        return self

    @model_validator(mode="after")
    def _check_repeat(self) -> Motion:
        if self.keyframes is None:
            return self
        first, last = self.keyframes[0], self.keyframes[-1]
        if self.repeat != "once" and (first[0] > 0 or len(self.keyframes) == 1):
            raise ValueError(f"`repeat: {self.repeat}` needs two keyframes or more, the first of them at 0 s")
        difference = max(math.dist(first[1:3], last[1:3]), abs(wrap(last[3] - first[3])))
        if self.repeat == "loop" and difference > LOOP_TOLERANCE_M_RAD:
            raise ValueError("the last keyframe of a loop must have the same pose as the first keyframe")
        duration = last[0] * (2 if self.repeat == "back_and_forth" else 1)
        if self.phase and self.phase >= duration:
            raise ValueError(f"phase {self.phase:g} s is not within the {duration:g} s that the keyframes take")
        return self

    def path(self, current: Pose2, start: float = 0.0) -> MotionPath:
        """Return the path of an object from the pose `current`. The object starts to move after `start` seconds."""
        if self.keyframes is None:
            assert self.through is not None and self.speed is not None
            return path_through_waypoints(current, self.through, self.speed, self.repeat, self.ease, start)
        times = [time for time, *_ in self.keyframes]
        poses = [Pose2(x, y, yaw) for _, x, y, yaw in self.keyframes]
        if times[0] > 0:
            times, poses = [0.0, *times], [current, *poses]
        if self.repeat == "loop":
            poses[-1] = poses[0]
        return MotionPath(tuple(times), tuple(poses), self.repeat, start, self.ease, self.phase)


def path_through_waypoints(
    current: Pose2, through: list[list[float]], speed: float, repeat: str, ease: str = "linear", start: float = 0.0
) -> MotionPath:
    """Return the path along straight lines from `current` through waypoints [x, y] at the top speed `speed` in m/s."""
    corners = [(current.x, current.y)]
    for x, y in [*through, *([[current.x, current.y]] if repeat == "loop" else [])]:
        if (x, y) != corners[-1]:
            corners.append((x, y))
    if len(corners) == 1:
        return MotionPath((0.0,), (current,), repeat, start)
    legs = [_Leg(Pose2(*a, math.atan2(b[1] - a[1], b[0] - a[0])), math.hypot(b[0] - a[0], b[1] - a[1]), b)
            for a, b in itertools.pairwise(corners)]  # fmt: skip
    timed_poses = _poses_with_stops if ease == "smooth" else _poses_at_constant_speed
    stops = timed_poses(legs, speed, repeat)
    return MotionPath(tuple(time for time, _ in stops), tuple(pose for _, pose in stops), repeat, start, ease)


class _Leg(NamedTuple):
    """Straight leg between two waypoints.

    `begin` is the pose at the beginning, with the heading of the leg. `length` is in m. `end_point` is (x, y) in m.
    """

    begin: Pose2
    length: float
    end_point: tuple[float, float]

    @property
    def end(self) -> Pose2:
        """The pose at the end, with the heading of the leg."""
        return Pose2(*self.end_point, self.begin.yaw)

    def pose_at(self, distance: float) -> Pose2:
        """Return the pose `distance` m after the beginning."""
        return self.begin.compose(Pose2(distance, 0.0))


def _poses_at_constant_speed(legs: list[_Leg], speed: float, repeat: str) -> list[tuple[float, Pose2]]:
    """Return times in s and poses of a motion without stops. Half of each turn is before the corner, half after it."""
    stops, time = [(0.0, legs[0].begin)], 0.0
    for leg, following in itertools.zip_longest(legs, legs[1:]):
        duration = leg.length / speed
        turn_time = min(CORNER_TURN_S, duration / 4)
        if stops[-1][1].yaw != leg.begin.yaw:
            stops.append((time + turn_time, leg.pose_at(turn_time * speed)))
        next_leg = following or (legs[0] if repeat == "loop" else leg)
        turn = wrap(next_leg.begin.yaw - leg.begin.yaw)
        if turn:
            stops.append((time + duration - turn_time, leg.pose_at(leg.length - turn_time * speed)))
        time += duration
        stops.append((time, leg.end._replace(yaw=wrap(leg.begin.yaw + turn / 2))))
    if repeat == "loop" and stops[-1][1].yaw != stops[0][1].yaw:
        first = stops[0]
        turn_time = min(CORNER_TURN_S, legs[0].length / speed / 4)
        stops[0] = (0.0, first[1]._replace(yaw=stops[-1][1].yaw))
        stops.insert(1, (turn_time, legs[0].pose_at(turn_time * speed)))
    if repeat == "loop":
        stops[-1] = (time, stops[0][1])
    return stops


def _poses_with_stops(legs: list[_Leg], speed: float, repeat: str) -> list[tuple[float, Pose2]]:
    """Return times in s and poses of a motion that stops at the end of each leg, and turns in place at corners."""
    stops, time = [(0.0, legs[0].begin)], 0.0
    for leg, following in itertools.zip_longest(legs, legs[1:]):
        time += SMOOTH_DURATION_FACTOR * leg.length / speed
        stops.append((time, leg.end))
        next_leg = following or (legs[0] if repeat == "loop" else leg)
        if wrap(next_leg.begin.yaw - leg.begin.yaw):
            time += 2 * CORNER_TURN_S
            stops.append((time, leg.end._replace(yaw=next_leg.begin.yaw)))
    return stops
