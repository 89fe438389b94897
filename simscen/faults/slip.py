"""`slip`: wheels turn more than they drive."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from simscen.core.geometry.kinematics import Twist
from simscen.faults.base import Disturbance, Fault, FaultSetting
from simscen.faults.common import OdometryDistortion
from simscen.spec.base import Spec
from simscen.spec.quantities import Quantity

SlipRatio = Annotated[float, Field(ge=0, lt=1), Quantity("ratio")]


class Slip(Spec, Fault):
    """Wheels slip: of each meter a wheel rolls, its slip ratio is lost; odometry counts it all the same.

    The slip ratio is that of vehicle dynamics when driving, s = 1 - v / (ω r) (Wong, Theory of Ground Vehicles,
    ch. 2). Left and right may differ; then the robot also turns without noticing. On `wheels` all odometry that counts
    how they turn is wrong; on a sensor only that one is.

    Example: `{sensor: odom, slip: {left: 30 %, right: 10 %}, when: {time: 5 s}, for: 4 s}`
    """

    affects: ClassVar[frozenset[str]] = frozenset({"Odometry", "Wheels"})
    idle: ClassVar[Mapping[str, object]] = {"left": 0.0, "right": 0.0}
    left: SlipRatio = 0.0
    """Slip ratio of the wheels on the left."""
    right: SlipRatio = 0.0
    """Slip ratio of the wheels on the right."""

    def begin(self, chance: np.random.Generator, setting: FaultSetting) -> Disturbance:
        """The ground gets less than the wheels turn."""
        return _Slipping(self, setting.separation)


class _Slipping(OdometryDistortion):
    drives = True

    def __init__(self, slip: Slip, separation: float) -> None:
        super().__init__()
        self._left, self._right, self._separation = 1 - slip.left, 1 - slip.right, separation

    def increment(self, step: Twist) -> Twist:
        """What the wheels turned for a true increment."""
        return self._scaled(step, 1 / self._left, 1 / self._right)

    def command(self, command: Twist) -> Twist | None:
        """What the ground gets of a commanded velocity."""
        return command if self._over else self._scaled(command, self._left, self._right)

    def _scaled(self, motion: Twist, left: float, right: float) -> Twist:
        half = self._separation / 2
        rolled_left, rolled_right = (
            (motion.vx - half * motion.wz) * left,
            (motion.vx + half * motion.wz) * right,
        )
        turn = (rolled_right - rolled_left) / self._separation if half else motion.wz * (left + right) / 2
        return Twist((rolled_left + rolled_right) / 2, motion.vy * (left + right) / 2, turn)
