"""The rows of a log that a localizer needs."""

from dataclasses import dataclass, field

from simscen.core.geometry import Array

TICK_RATE = 1000
"""Ticks a second."""
Triple = tuple[float, float, float]


@dataclass(frozen=True)
class Stamped:
    """A pose x, y, yaw at a time in s; `order` is its place in the log."""

    time: float
    order: int
    pose: Triple


@dataclass(frozen=True, eq=False)
class Range:
    """A scan at a time in s: `layout` is its first angle, increment, least and greatest range; `mount` the lidar's."""

    time: float
    order: int
    ranges: Array
    layout: tuple[float, float, float, float]
    mount: Triple = (0.0, 0.0, 0.0)


@dataclass
class Rows:
    """What a log says; `hint` is what helps where something is missing."""

    odometry: list[Stamped] = field(default_factory=list)
    scans: list[Range] = field(default_factory=list)
    truth: list[Stamped] = field(default_factory=list)
    hint: str = ""
