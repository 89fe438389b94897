"""`gain`: the base does more or less than it is told."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from simscen.core.geometry.kinematics import Twist
from simscen.faults.base import Disturbance, Fault, FaultSetting, Instance
from simscen.faults.common import inapplicable_side, side_speeds, twist_from_sides
from simscen.spec.base import Spec
from simscen.spec.quantities import Quantity

Factor = Annotated[float, Field(ge=-10, le=10), Quantity("ratio")]


class Gain(Spec, Fault):
    """The base drives a multiple of what it is told: a wrong scaling in the driver, a motor with worn brushes.

    On `cmd_vel` the command is scaled on its way; on `wheels` each side can be scaled alone, so that the robot pulls to
    the weaker one. Odometry measures what is really driven. A negative gain is a motor that is wired the wrong way.

    Example: `{sensor: wheels, gain: {left: 80 %}}`
    """

    affects: ClassVar[frozenset[str]] = frozenset({"Command", "Wheels"})
    idle: ClassVar[Mapping[str, object]] = dict.fromkeys(("linear", "angular", "left", "right"), 1.0)
    linear: Factor = 1.0
    """Driven over commanded speed, forward and sideways."""
    angular: Factor = 1.0
    """Turned over commanded turn rate."""
    left: Factor = 1.0
    """The same of the wheels on the left; of `wheels` only."""
    right: Factor = 1.0
    """Of those on the right."""

    def senseless(self, instance: Instance) -> tuple[str, str] | None:
        """Sides of what has none."""
        for key in ("left", "right"):
            if key in self.model_fields_set and (why := inapplicable_side(instance, key)):
                return why
        return None

    def begin(self, chance: np.random.Generator, setting: FaultSetting) -> Disturbance:
        """From now on."""
        return _Scaled(self, setting.separation)


class _Scaled(Disturbance):
    def __init__(self, gain: Gain, separation: float) -> None:
        self._gain, self._separation = gain, separation

    def command(self, command: Twist) -> Twist | None:
        gain, separation = self._gain, self._separation
        scaled = Twist(gain.linear * command.vx, gain.linear * command.vy, gain.angular * command.wz)
        if not separation or gain.left == gain.right == 1:
            return scaled
        left, right = side_speeds(scaled, separation)
        return twist_from_sides(gain.left * left, gain.right * right, scaled.vy, separation)
