"""Common form into which the readers of all formats convert a localization log."""

from collections.abc import Iterable
from dataclasses import dataclass, field

from simscen.core.geometry import Array, Pose2

TICK_RATE_HZ = 1000
"""Ticks per second to which the times of a log are rounded."""
MAX_TIME_S, MAX_COORDINATE_M = 1e11, 1e6
"""Largest valid time and coordinate. Broken sensors can report larger ones, whose squares could overflow."""


@dataclass(frozen=True)
class PoseRow:
    """Pose at a time in s. `order` is the index of the line or message in the log."""

    time: float
    order: int
    pose: Pose2


@dataclass(frozen=True, eq=False)
class ScanRow:
    """Scan at a time in s, with ranges (n,) in m.

    `order` is the index of the line or message in the log. `layout` is the first angle, the angle increment (rad), and
    the minimum and maximum range (m). `mount` is the pose of the lidar on the base.
    """

    time: float
    order: int
    ranges: Array
    layout: tuple[float, float, float, float]
    mount: Pose2 = Pose2(0.0, 0.0)


@dataclass
class LocalizationRows:
    """Content of a localization log.

    `truth` are the reference poses, and `initial` the initial poses that were sent to the localizer. `hint` is shown to
    the user if odometry or scans are missing. `notes` are remarks for the user.
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
