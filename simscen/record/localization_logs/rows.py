"""Rows of a log that a localizer needs: odometry, scans and reference poses."""

from collections.abc import Iterable
from dataclasses import dataclass, field

from simscen.core.geometry import Array, Pose2

TICK_RATE_HZ = 1000
MAX_TIME_S, MAX_COORDINATE_M = 1e11, 1e6
"""Limits for valid times and coordinates. Squares of larger numbers, as from broken sensors, could overflow."""


@dataclass(frozen=True)
class PoseRow:
    """A pose at a time in s. `order` is the index of the row in the log."""

    time: float
    order: int
    pose: Pose2


@dataclass(frozen=True, eq=False)
class ScanRow:
    """A scan at a time in s. `layout` is first angle, angle increment, minimum and maximum range.

    `order` is the index of the row in the log, `mount` the pose of the lidar on the base.
    """

    time: float
    order: int
    ranges: Array
    layout: tuple[float, float, float, float]
    mount: Pose2 = Pose2(0.0, 0.0)


@dataclass
class LocalizationRows:
    """Rows of a log.

    `truth` are the reference poses and `initial` the poses sent to the localizer. `hint` is shown if rows are missing,
    `notes` are remarks for the user.
    """

    odometry: list[PoseRow] = field(default_factory=list)
    scans: list[ScanRow] = field(default_factory=list)
    truth: list[PoseRow] = field(default_factory=list)
    initial: list[PoseRow] = field(default_factory=list)
    hint: str = ""
    notes: list[str] = field(default_factory=list)


def all_within(values: Iterable[float], limit: float) -> bool:
    """Return whether all values are numbers within ±`limit`."""
    return all(-limit < value < limit for value in values)
