"""`bias`: odometry over- or under-reports, steadily."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from simscen.core.motion import Twist
from simscen.faults._odometry import OdometryDistortion
from simscen.faults.base import Disturbance, Fault, Wheels
from simscen.spec.base import Spec
from simscen.spec.quantities import Angle, Ratio


class Bias(Spec, Fault):
    """Odometry reports a scaled distance and turn, plus a steady turn for each metre driven.

    Example: `{sensor: odom, bias: {linear_scale: 1.1, turn_per_metre: 0.05}}`
    """

    affects: ClassVar[frozenset[str]] = frozenset({"Odometry"})
    linear_scale: Ratio = 1.0
    """Reported distance per driven distance: a worn wheel of 95 % radius reports 1.05."""
    angular_scale: Ratio = 1.0
    """Reported turn per true turn."""
    turn_per_metre: Angle = 0.0
    """Radians of turn reported for each metre driven forward: unequal wheel radii."""

    def begin(self, chance: np.random.Generator, wheels: Wheels) -> Disturbance:
        """Scale each increment."""
        return _Scaled(self)


class _Scaled(OdometryDistortion):
    def __init__(self, bias: Bias) -> None:
        super().__init__()
        self._bias = bias

    def increment(self, step: Twist) -> Twist:
        turn = step.wz * self._bias.angular_scale + step.vx * self._bias.turn_per_metre
        return Twist(step.vx * self._bias.linear_scale, step.vy * self._bias.linear_scale, turn)
