"""How something moves by a script, as a user writes it: through waypoints at a speed, or along timed keyframes."""

from __future__ import annotations

import itertools
import math
from typing import Annotated, Literal, NamedTuple

from pydantic import AfterValidator, Field, model_validator

from simscen.core.geometry import Pose2, Pose3, wrap
from simscen.core.geometry.shapes import Box, Cylinder, Extrusion, MotionPath, Shape, Solid
from simscen.spec.base import Spec
from simscen.spec.places import PlaceOrPoint, Ring
from simscen.spec.quantities import Angle, Duration, Length, NonNegativeLength, PositiveLength, PositiveSpeed

CORNER_TURN_S = 0.25
"""Seconds before and after a corner in which something that drives through it turns, or a quarter of a shorter way."""
SMOOTH_DURATION_FACTOR = 1.5
"""How much longer a way takes that is eased from rest to rest, at the same top speed."""
LOOP_TOLERANCE = 1e-6
"""Meters and radians within which the last keyframe of a loop is its first."""

Keyframe = Annotated[tuple[Duration, Length, Length, Angle], Field(strict=False)]


def _rising(keyframes: list[tuple[float, float, float, float]]) -> list[tuple[float, float, float, float]]:
    for before, after in itertools.pairwise(keyframes):
        if after[0] <= before[0]:
            raise ValueError(f"the times of keyframes must rise, but {after[0]:g} s comes after {before[0]:g} s")
    return keyframes


class Motion(Spec):
    """A scripted motion."""

    through: Annotated[list[PlaceOrPoint], Field(min_length=1, max_length=1000)] | None = None
    """Waypoints, [x, y] in the world frame or places by name, after where it is: it drives along straight lines and
    faces where it drives.
    """
    speed: PositiveSpeed | None = None
    """Along the lines through waypoints; its greatest one where it is eased."""
    keyframes: Annotated[list[Keyframe], Field(min_length=1, max_length=1000), AfterValidator(_rising)] | None = None
    """Instead of waypoints where it is when: [t, x, y, yaw] in the world frame, t from the beginning of the motion.
    A first one at 0 sets it there at once; to a later one it comes from where it is. Turns go the shorter way."""
    repeat: Literal["once", "loop", "back_and_forth"] = "once"
    """At the end: stay, start over, or turn around. A loop through waypoints leads back to where it began; one of
    keyframes has to end at its first keyframe."""
    ease: Literal["linear", "smooth", "spline"] = "linear"
    """`linear`: at constant speed from one waypoint or keyframe to the next. `smooth`: from rest to rest between any
    two, 3u² - 2u³ of the way after a share u of the time, at most 1.5 times as fast as evenly. `spline`: through
    keyframes without a stop, a cubic Hermite curve with the velocities of Catmull and Rom for uneven times,
    (next - previous) / (their times' difference), at rest at both ends but in a loop."""
    phase: Duration = 0.0
    """How far into its keyframes it begins, so that several things share them and keep apart."""

    @model_validator(mode="after")
    def _one_way(self) -> Motion:
        if (self.through is None) == (self.keyframes is None):
            raise ValueError("expected through and speed, or keyframes")
        if (self.through is None) != (self.speed is None):
            raise ValueError("expected speed along waypoints" if self.through else "keyframes have times, and no speed")
        if self.through is not None and self.ease == "spline":
            raise ValueError("`ease: spline` needs keyframes: where it is when, not only a speed")
        if self.through is not None and self.phase:
            raise ValueError("phase is for keyframes")
        return self

    @model_validator(mode="after")
    def _repeatable(self) -> Motion:
        if self.keyframes is None:
            return self
        first, last = self.keyframes[0], self.keyframes[-1]
        if self.repeat != "once" and (first[0] > 0 or len(self.keyframes) == 1):
            raise ValueError(f"`repeat: {self.repeat}` needs two keyframes or more, the first of them at 0 s")
        apart = max(math.dist(first[1:3], last[1:3]), abs(wrap(last[3] - first[3])))
        if self.repeat == "loop" and apart > LOOP_TOLERANCE:
            raise ValueError("a loop jumps unless its last keyframe is where its first one is: repeat that at the end")
        lasts = last[0] * (2 if self.repeat == "back_and_forth" else 1)
        if self.phase and self.phase >= lasts:
            raise ValueError(f"phase {self.phase:g} s is not within the {lasts:g} s that the keyframes take")
        return self

    def path(self, here: Pose2, start: float = 0.0) -> MotionPath:
        """The path of something that is `here` now, set off `start` seconds from now."""
        if self.keyframes is not None:
            return _timed(here, self.keyframes, self.repeat, start, self.ease, self.phase)
        assert self.through is not None and self.speed is not None
        return route(here, self.through, self.speed, self.repeat, self.ease, start)


def _timed(
    here: Pose2,
    keyframes: list[tuple[float, float, float, float]],
    repeat: str,
    start: float,
    ease: str,
    phase: float,
) -> MotionPath:
    times, poses = [t for t, *_ in keyframes], [Pose2(x, y, yaw) for _, x, y, yaw in keyframes]
    if times[0] > 0:
        times, poses = [0.0, *times], [here, *poses]
    if repeat == "loop":
        poses[-1] = poses[0]
    return MotionPath(tuple(times), tuple(poses), repeat, start, ease, phase)


def route(
    here: Pose2, through: list[list[float]], speed: float, repeat: str, ease: str = "linear", start: float = 0.0
) -> MotionPath:
    """Times and poses along straight lines at `speed`, or at no more than it when eased; `loop` closes the circle."""
    corners = [(here.x, here.y)]
    for x, y in [*through, *([[here.x, here.y]] if repeat == "loop" else [])]:
        if (x, y) != corners[-1]:
            corners.append((x, y))
    if len(corners) == 1:
        return MotionPath((0.0,), (here,), repeat, start)
    legs = [_Leg(Pose2(*a, math.atan2(b[1] - a[1], b[0] - a[0])), math.hypot(b[0] - a[0], b[1] - a[1]), b)
            for a, b in itertools.pairwise(corners)]  # fmt: skip
    stops = _eased(legs, speed, repeat) if ease == "smooth" else _even(legs, speed, repeat)
    return MotionPath(tuple(time for time, _ in stops), tuple(pose for _, pose in stops), repeat, start, ease)


class _Leg(NamedTuple):
    """A straight way: from where, heading along it, how far in meters, and where to."""

    begin: Pose2
    length: float
    to: tuple[float, float]

    @property
    def end(self) -> Pose2:
        return Pose2(*self.to, self.begin.yaw)

    def along(self, meters: float) -> Pose2:
        return self.begin.compose(Pose2(meters, 0.0))


def _even(legs: list[_Leg], speed: float, repeat: str) -> list[tuple[float, Pose2]]:
    """At a constant speed; around each corner the heading turns evenly, half of the turn on either side."""
    stops, time = [(0.0, legs[0].begin)], 0.0
    for leg, following in itertools.zip_longest(legs, legs[1:]):
        lasts = leg.length / speed
        turned = min(CORNER_TURN_S, lasts / 4)
        if stops[-1][1].yaw != leg.begin.yaw:
            stops.append((time + turned, leg.along(turned * speed)))
        ahead = following or (legs[0] if repeat == "loop" else leg)
        turn = wrap(ahead.begin.yaw - leg.begin.yaw)
        if turn:
            stops.append((time + lasts - turned, leg.along(leg.length - turned * speed)))
        time += lasts
        stops.append((time, leg.end._replace(yaw=wrap(leg.begin.yaw + turn / 2))))
    if repeat == "loop" and stops[-1][1].yaw != stops[0][1].yaw:
        first = stops[0]
        turned = min(CORNER_TURN_S, legs[0].length / speed / 4)
        stops[0] = (0.0, first[1]._replace(yaw=stops[-1][1].yaw))
        stops.insert(1, (turned, legs[0].along(turned * speed)))
    if repeat == "loop":
        stops[-1] = (time, stops[0][1])
    return stops


def _eased(legs: list[_Leg], speed: float, repeat: str) -> list[tuple[float, Pose2]]:
    """From rest to rest along each way; in each corner it turns in place."""
    stops, time = [(0.0, legs[0].begin)], 0.0
    for leg, following in itertools.zip_longest(legs, legs[1:]):
        time += SMOOTH_DURATION_FACTOR * leg.length / speed
        stops.append((time, leg.end))
        ahead = following or (legs[0] if repeat == "loop" else leg)
        if wrap(ahead.begin.yaw - leg.begin.yaw):
            time += 2 * CORNER_TURN_S
            stops.append((time, leg.end._replace(yaw=ahead.begin.yaw)))
    return stops


# MERGED: Things that stand or move in a world, as a user writes them.
class Shaped(Spec):
    """Something with one simple shape that stands on the ground, or `z` above it."""

    box: Annotated[list[PositiveLength], Field(min_length=3, max_length=3)] | None = None
    """A box: length along x, width along y, height."""
    cylinder: Annotated[list[PositiveLength], Field(min_length=2, max_length=2)] | None = None
    """An upright cylinder: radius, height."""
    polygon: Ring | None = None
    """An upright prism over these corners, `height` tall."""
    height: PositiveLength = 1.0
    """Height of the prism over `polygon`."""
    z: NonNegativeLength = 0.0
    """How far its underside is above the ground."""

    @model_validator(mode="after")
    def _one_shape(self) -> Shaped:
        if sum(shape is not None for shape in (self.box, self.cylinder, self.polygon)) != 1:
            raise ValueError("expected exactly one of: box, cylinder, polygon")
        return self

    @property
    def tall(self) -> float:
        """Its own height in meters."""
        return self.box[2] if self.box is not None else self.cylinder[1] if self.cylinder is not None else self.height

    def solid(self, name: str) -> Solid:
        """The shape in the object's own frame, which is on the ground below it."""
        shape: Shape
        if self.box is not None:
            shape, middle = Box((self.box[0], self.box[1], self.box[2])), self.box[2] / 2
        elif self.cylinder is not None:
            shape, middle = Cylinder(self.cylinder[0], self.cylinder[1]), self.cylinder[1] / 2
        else:
            assert self.polygon is not None
            shape, middle = Extrusion(tuple((x, y) for x, y in self.polygon), self.height), 0.0
        return Solid(shape, Pose3(z=self.z + middle), name)
