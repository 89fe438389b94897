"""Faults of single beams and ranges: `beam_dropout`, `sector`, `range_limit`, and `ghost`."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import ClassVar

import numpy as np
from pydantic import Field

from simscen.core.messages.sensor_data import Image, Reading, Scan
from simscen.faults.base import Disturbance, Fault, FaultSetting, Instance
from simscen.spec.base import Spec
from simscen.spec.quantities import Angle, PositiveAngle, PositiveLength, Probability


class BeamDropout(Spec, Fault):
    """Each beam of each scan gives no answer (nan) with a probability, as over dark or wet surfaces.

    Example: `{sensor: lidar, beam_dropout: {probability: 40 %}}`
    """

    affects: ClassVar[frozenset[str]] = frozenset({"Scan"})
    idle: ClassVar[Mapping[str, object]] = {"probability": 0.0}
    probability: Probability
    """The chance that a beam gives no answer."""

    def begin(self, chance: np.random.Generator, setting: FaultSetting) -> Disturbance:
        """Draw once for each beam."""
        return _Holes(chance, self.probability)


class _Holes(Disturbance):
    def __init__(self, chance: np.random.Generator, probability: float) -> None:
        self._chance, self._probability = chance, probability

    def reading(self, reading: Reading) -> Reading | None:
        if not isinstance(reading, Scan):
            return reading
        lost = self._chance.random(len(reading.ranges)) < self._probability
        return replace(reading, ranges=np.where(lost, np.nan, reading.ranges))


class Sector(Spec, Fault):
    """Beams of some directions give no answer (nan): dirt on the cover, a cable or a load in front of it, a mask.

    Example: `{sensor: lidar, sector: {from: -30 deg, to: 30 deg}}`
    """

    affects: ClassVar[frozenset[str]] = frozenset({"Scan"})
    from_: Angle = Field(alias="from")
    """The first blind direction in the lidar's frame (0 = where it looks)."""
    to: Angle
    """The last one, going anticlockwise."""

    @property
    def width(self) -> float:
        """Radians from the first to the last, anticlockwise; a whole turn for a whole turn."""
        turn = 2 * math.pi
        return turn if self.to - self.from_ >= turn - 1e-9 else (self.to - self.from_) % turn

    def senseless(self, instance: Instance) -> tuple[str, str] | None:
        """A sector of no width."""
        return ("to", "the sector ends where it begins") if not self.width else None

    def begin(self, chance: np.random.Generator, setting: FaultSetting) -> Disturbance:
        """The same beams of each scan."""
        return _Blind(self.from_, self.width)


class _Blind(Disturbance):
    def __init__(self, first: float, width: float) -> None:
        self._first, self._width = first, width

    def reading(self, reading: Reading) -> Reading | None:
        if not isinstance(reading, Scan):
            return reading
        after = np.remainder(reading.angles() - self._first + 1e-9, 2 * math.pi)
        return replace(reading, ranges=np.where(after <= self._width + 2e-9, np.nan, reading.ranges))


class RangeLimit(Spec, Fault):
    """What is farther away than this returns nothing (inf), as if nothing were there: dark surfaces, a weak laser.

    Example: `{sensor: lidar, range_limit: {max: 3 m}}`
    """

    affects: ClassVar[frozenset[str]] = frozenset({"Scan", "Image"})
    max: PositiveLength
    """The largest range or depth that is still measured."""

    def senseless(self, instance: Instance) -> tuple[str, str] | None:
        """A limit beyond the sensor's own."""
        own = getattr(instance.spec, "max_range", None)
        if own is None or self.max < own:
            return None
        return "max", f"{self.max:g} m limits nothing: the sensor's own range is {own:g} m"

    def begin(self, chance: np.random.Generator, setting: FaultSetting) -> Disturbance:
        """From now on."""
        return _Short(self.max)


class _Short(Disturbance):
    def __init__(self, most: float) -> None:
        self._most = most

    def reading(self, reading: Reading) -> Reading | None:
        match reading:
            case Scan(ranges=ranges):
                with np.errstate(invalid="ignore"):
                    return replace(reading, ranges=np.where(ranges > self._most, np.inf, ranges))
            case Image(depth=depth):
                return replace(reading, depth=np.where(depth > self._most, np.float32(np.inf), depth))
            case _:
                return reading


class Ghost(Spec, Fault):
    """Beams of a window return something that is not there, nearer than what is: a mirror, a vest, the own cover.

    It keeps its place in the lidar's frame, and so drives along with the robot.

    Example: `{sensor: lidar, ghost: {range: 1 m, direction: 0 deg, width: 10 deg}}`
    """

    affects: ClassVar[frozenset[str]] = frozenset({"Scan"})
    idle: ClassVar[Mapping[str, object]] = {"probability": 0.0}
    range: PositiveLength
    """Where the ghost is; beams that meet something nearer tell that."""
    direction: Angle = 0.0
    """Of the window's middle in the lidar's frame."""
    width: PositiveAngle = 0.17453292519943295
    """Of the window."""
    probability: Probability = 1.0
    """The chance that a beam of the window sees it, anew for each scan."""

    def senseless(self, instance: Instance) -> tuple[str, str] | None:
        """A ghost that the lidar cannot see."""
        least, most = (getattr(instance.spec, key, None) for key in ("min_range", "max_range"))
        if least is None or most is None or least <= self.range <= most:
            return None
        return "range", f"the sensor measures from {least:g} m to {most:g} m"

    def begin(self, chance: np.random.Generator, setting: FaultSetting) -> Disturbance:
        """Draw for each beam of the window."""
        return _Haunted(chance, self)


class _Haunted(Disturbance):
    def __init__(self, chance: np.random.Generator, ghost: Ghost) -> None:
        self._chance, self._ghost = chance, ghost

    def reading(self, reading: Reading) -> Reading | None:
        if not isinstance(reading, Scan):
            return reading
        ghost = self._ghost
        off = np.remainder(reading.angles() - ghost.direction + math.pi, 2 * math.pi) - math.pi
        seen = (np.abs(off) <= ghost.width / 2) & (self._chance.random(len(off)) < ghost.probability)
        nearer = np.fmin(reading.ranges, ghost.range)
        return replace(reading, ranges=np.where(seen, nearer, reading.ranges))
