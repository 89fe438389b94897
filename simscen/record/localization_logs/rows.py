"""Content of a localization log, in the same form for all formats of logs."""

from collections.abc import Iterable
from dataclasses import dataclass, field

from simscen.core.geometry import Array, Pose2

TICK_RATE_HZ = 1000
"""Ticks per second. Times are rounded to ticks."""
MAX_TIME_S = 1e11
"""Maximum absolute value of a valid time."""
MAX_COORDINATE_M = 1e6
"""Maximum absolute value of a valid coordinate."""


@dataclass(frozen=True)
class PoseRow:
    """Pose at a time in s. `order` is the index of the line or message in the log."""

    time: float
    order: int
    pose: Pose2


@dataclass(frozen=True, eq=False)
class ScanRow:
    """Scan at a time in s, with ranges (n,) in m.

    order:   index of the line or message in the log
    layout:  first angle and angle increment in rad, minimum and maximum range in m
    mount:   pose of the lidar on the base
    """

    time: float
    order: int
    ranges: Array
    layout: tuple[float, float, float, float]
    mount: Pose2 = Pose2(0.0, 0.0)


@dataclass
class LocalizationRows:
    """Content of a localization log.

    odometry:       poses in the odom frame
    scans:          scans of the lidar
    truth:          reference poses in the map frame
    initial_poses:  initial poses for the localizer in the map frame
    hint:           hint for the user if odometry or scans are missing
    notes:          remarks for the user
    """

    odometry: list[PoseRow] = field(default_factory=list)
    scans: list[ScanRow] = field(default_factory=list)
    truth: list[PoseRow] = field(default_factory=list)
    initial_poses: list[PoseRow] = field(default_factory=list)
    hint: str = ""
    notes: list[str] = field(default_factory=list)


def all_within(values: Iterable[float], limit: float) -> bool:
    """Return whether the absolute values of all numbers are below `limit`. A value of nan is not."""
    return all(-limit < value < limit for value in values)
