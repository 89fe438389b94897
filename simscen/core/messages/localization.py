"""Where a robot thinks it is."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from simscen.core.decorators import fast_dataclass
from simscen.core.geometry import Array, Pose2


@dataclass(frozen=True, eq=False)
class Estimate:
    """What a localizer is told at the start: `pose` with standard deviations (m, m, rad); None = anywhere."""

    pose: Pose2 | None
    std: tuple[float, float, float] = (0.5, 0.5, 0.2618)


@fast_dataclass(eq=False)
class Belief:
    """A localizer's answer: `pose` in the map frame and its covariance (3, 3) over (x, y, yaw).

    `map_from_odom` is the correction it publishes on /tf. `particles` (n, 4) holds x, y, yaw, weight where there are
    any. `updated` is the tick of the newest measurement that changed it.
    """

    pose: Pose2
    covariance: Array
    map_from_odom: Pose2 = Pose2(0.0, 0.0, 0.0)
    particles: Array = field(default_factory=lambda: np.empty((0, 4)))
    updated: int = 0
