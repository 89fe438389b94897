"""`jump`: the localizer is suddenly somewhere else."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import ClassVar

import numpy as np

from simscen.core.geometry import Pose2
from simscen.core.messages.navigation import Belief
from simscen.faults.base import Disturbance, Fault, FaultSetting
from simscen.spec.base import Spec
from simscen.spec.quantities import Angle, Length


class Jump(Spec, Fault):
    """The navigator is told to be elsewhere from one moment to the next: a localizer that takes one aisle for another.

    The jump is that of the robot's pose when the fault begins, in its own frame; from then on the map is off by it as
    seen from the robot, until the fault ends and the belief jumps back. The localizer itself goes on undisturbed.

    Example: `{sensor: localizer, jump: {x: 1 m, yaw: 10 deg}, when: {time: 5 s}, for: 3 s}`
    """

    affects: ClassVar[frozenset[str]] = frozenset({"Belief"})
    idle: ClassVar[Mapping[str, object]] = {"x": 0.0, "y": 0.0, "yaw": 0.0}
    x: Length = 0.0
    """Forward."""
    y: Length = 0.0
    """To the left."""
    yaw: Angle = 0.0
    """Anticlockwise."""

    def begin(self, chance: np.random.Generator, setting: FaultSetting) -> Disturbance:
        """With the next belief."""
        return _Jumped(Pose2(self.x, self.y, self.yaw))


class _Jumped(Disturbance):
    def __init__(self, by: Pose2) -> None:
        self._by = by
        self._moved: Pose2 | None = None

    def belief(self, belief: Belief) -> Belief:
        if self._moved is None:
            self._moved = belief.pose.compose(self._by).compose(belief.pose.inverse())
        moved = self._moved
        return replace(belief, pose=moved.compose(belief.pose), map_from_odom=moved.compose(belief.map_from_odom))
