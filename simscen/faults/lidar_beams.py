"""Faults of single beams and ranges: `beam_dropout`, `sector`, `range_limit`, and `ghost`."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import ClassVar

import numpy as np
from pydantic import Field

from simscen.core.geometry import Array
from simscen.core.messages.sensor_data import Image, Reading, Scan
from simscen.faults.base import Fault, FaultEffect, FaultSetting, FaultTarget
from simscen.faults.common import ChangedRanges, ChangedReadings
from simscen.spec.base import Spec
from simscen.spec.quantities import Angle, PositiveAngle, PositiveLength, Probability


class BeamDropout(Spec, Fault):
    """Each beam of each scan returns nothing (nan) with a fixed probability, as on dark or wet surfaces.

    Example: `{sensor: lidar, beam_dropout: {probability: 40 %}}`
    """

    affects: ClassVar[frozenset[str]] = frozenset({"Scan"})
    neutral_values: ClassVar[Mapping[str, object]] = {"probability": 0.0}
    probability: Probability
    """Probability that a beam returns nothing."""

    def begin(self, rng: np.random.Generator, setting: FaultSetting) -> FaultEffect:
        def ranges(scan: Scan) -> Array:
            is_lost = rng.random(len(scan.ranges)) < self.probability
            return np.where(is_lost, np.nan, scan.ranges)

        return ChangedRanges(ranges)


class Sector(Spec, Fault):
    """Beams in a range of directions return nothing (nan): dirt on the lidar, or a cable or load in front of the lidar.

    Example: `{sensor: lidar, sector: {from: -30 deg, to: 30 deg}}`
    """

    affects: ClassVar[frozenset[str]] = frozenset({"Scan"})
    from_: Angle = Field(alias="from")
    """First blind direction in the lidar's frame (0 = forward)."""
    to: Angle
    """Last blind direction, counterclockwise from the first."""

    @property
    def width(self) -> float:
        """Counterclockwise angle in rad from the first to the last blind direction; at most 2 pi."""
        turn = 2 * math.pi
        return turn if self.to - self.from_ >= turn - 1e-9 else (self.to - self.from_) % turn

    def unsuitable_key(self, target: FaultTarget) -> tuple[str, str] | None:
        return ("to", "the sector ends where it begins") if not self.width else None

    def begin(self, rng: np.random.Generator, setting: FaultSetting) -> FaultEffect:
        def ranges(scan: Scan) -> Array:
            offsets = np.remainder(scan.angles() - self.from_ + 1e-9, 2 * math.pi)
            return np.where(offsets <= self.width + 2e-9, np.nan, scan.ranges)

        return ChangedRanges(ranges)


class RangeLimit(Spec, Fault):
    """Objects beyond a distance return nothing (inf), as if they did not exist: dark surfaces, a weak laser.

    Example: `{sensor: lidar, range_limit: {max: 3 m}}`
    """

    affects: ClassVar[frozenset[str]] = frozenset({"Scan", "Image"})
    max: PositiveLength
    """Largest range or depth that is still measured."""

    def unsuitable_key(self, target: FaultTarget) -> tuple[str, str] | None:
        sensor_range = getattr(target.spec, "max_range", None)
        if sensor_range is None or self.max < sensor_range:
            return None
        return "max", f"{self.max:g} m is no limit: the range of the sensor is {sensor_range:g} m"

    def begin(self, rng: np.random.Generator, setting: FaultSetting) -> FaultEffect:
        return ChangedReadings(self._limit_reading)

    def _limit_reading(self, reading: Reading) -> Reading:
        match reading:
            case Scan(ranges=ranges):
                with np.errstate(invalid="ignore"):
                    return replace(reading, ranges=np.where(ranges > self.max, np.inf, ranges))
            case Image(depth=depth):
                return replace(reading, depth=np.where(depth > self.max, np.float32(np.inf), depth))
            case _:
                return reading


class Ghost(Spec, Fault):
    """Beams in a window of directions hit an object that does not exist, for example because of a reflection.

    The ghost is fixed in the lidar's frame and therefore moves with the robot.

    Example: `{sensor: lidar, ghost: {range: 1 m, direction: 0 deg, width: 10 deg}}`
    """

    affects: ClassVar[frozenset[str]] = frozenset({"Scan"})
    neutral_values: ClassVar[Mapping[str, object]] = {"probability": 0.0}
    range: PositiveLength
    """Distance of the ghost. Beams that hit a nearer object measure this object."""
    direction: Angle = 0.0
    """Center of the window in the lidar's frame."""
    width: PositiveAngle = 0.17453292519943295
    """Width of the window."""
    probability: Probability = 1.0
    """Probability that a beam of the window hits the ghost, drawn again for each scan."""

    def unsuitable_key(self, target: FaultTarget) -> tuple[str, str] | None:
        nearest, farthest = (getattr(target.spec, key, None) for key in ("min_range", "max_range"))
        if nearest is None or farthest is None or nearest <= self.range <= farthest:
            return None
        return "range", f"the sensor measures from {nearest:g} m to {farthest:g} m"

    def begin(self, rng: np.random.Generator, setting: FaultSetting) -> FaultEffect:
        def ranges(scan: Scan) -> Array:
            offsets = np.remainder(scan.angles() - self.direction + math.pi, 2 * math.pi) - math.pi
            is_hit = (np.abs(offsets) <= self.width / 2 + 1e-9) & (rng.random(len(offsets)) < self.probability)
            return np.where(is_hit, np.fmin(scan.ranges, self.range), scan.ranges)

        return ChangedRanges(ranges)
