"""The rows of a log that a localizer needs."""

from collections.abc import Iterable
from dataclasses import dataclass, field

from simscen.core.geometry import Array

TICK_RATE_HZ = 1000
"""Ticks a second."""
MAX_TIME_S, MAX_COORDINATE_M = 1e11, 1e6
"""No reading has a time beyond this (s) or a place (m): squares of what a broken sensor may say would overflow."""
Triple = tuple[float, float, float]


@dataclass(frozen=True)
class PoseRow:
    """A pose x, y, yaw at a time in s; `order` is its place in the log."""

    time: float
    order: int
    pose: Triple


@dataclass(frozen=True, eq=False)
class ScanRow:
    """A scan at a time in s: `layout` is its first angle, increment, least and greatest range; `mount` the lidar's."""

    time: float
    order: int
    ranges: Array
    layout: tuple[float, float, float, float]
    mount: Triple = (0.0, 0.0, 0.0)


@dataclass
class LocalizationRows:
    """What a log says; `hint` is what helps where something is missing, `notes` are what is odd.

    `initial` is where the robot was told to be.
    """

    odometry: list[PoseRow] = field(default_factory=list)
    scans: list[ScanRow] = field(default_factory=list)
    truth: list[PoseRow] = field(default_factory=list)
    initial: list[PoseRow] = field(default_factory=list)
    hint: str = ""
    notes: list[str] = field(default_factory=list)


def all_within(values: Iterable[float], largest: float) -> bool:
    """Whether all of these are numbers, and none too large."""
    return all(-largest < value < largest for value in values)
