"""`saturation`: the base cannot do what it should."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field

from simscen.core.geometry.kinematics import Twist
from simscen.faults.base import Disturbance, Fault, FaultSetting, Instance
from simscen.faults.common import inapplicable_side, side_speeds, twist_from_sides
from simscen.spec.base import Spec
from simscen.spec.quantities import PositiveAcceleration, PositiveAngularAcceleration, Quantity

SpeedLimit = Annotated[float, Field(ge=0, le=100), Quantity("speed")]
TurnLimit = Annotated[float, Field(ge=0, le=100), Quantity("angular speed")]


class Saturation(Spec, Fault):
    """Speeds and accelerations are limited more than they should be: a motor too weak or too hot, a low battery.

    On `cmd_vel` commands are limited on their way; on `wheels` each side can be limited alone, so that the robot turns
    towards the weaker one when it drives fast. Odometry measures what is really driven.

    Example: `{sensor: wheels, saturation: {left: 0.2 m/s}}`
    """

    affects: ClassVar[frozenset[str]] = frozenset({"Command", "Wheels"})
    idle: ClassVar[Mapping[str, object]] = dict.fromkeys(
        ("linear", "angular", "linear_acceleration", "angular_acceleration", "left", "right")
    )
    linear: SpeedLimit | None = None
    """Largest speed over ground, in any direction."""
    angular: TurnLimit | None = None
    """Largest turn rate."""
    linear_acceleration: PositiveAcceleration | None = None
    """Largest change of speed, faster or slower."""
    angular_acceleration: PositiveAngularAcceleration | None = None
    """Largest change of the turn rate."""
    left: SpeedLimit | None = None
    """Largest speed at which the wheels on the left roll, either way; of `wheels` only."""
    right: SpeedLimit | None = None
    """Of those on the right."""

    def senseless(self, instance: Instance) -> tuple[str, str] | None:
        """Sides of what has none."""
        for key in ("left", "right"):
            if getattr(self, key) is not None and (why := inapplicable_side(instance, key)):
                return why
        return None

    def begin(self, chance: np.random.Generator, setting: FaultSetting) -> Disturbance:
        """From now on."""
        return _Weak(self, setting)


class _Weak(Disturbance):
    def __init__(self, spec: Saturation, setting: FaultSetting) -> None:
        self._spec, self._setting = spec, setting
        self._last: tuple[int, Twist] | None = None

    def command(self, command: Twist) -> Twist | None:
        limited = self._within_speeds(command)
        now = self._setting.now()
        if self._last is not None:
            seconds = self._setting.clock.seconds(now - self._last[0])
            limited = self._within_accelerations(self._last[1], limited, seconds)
        self._last = now, limited
        return limited

    def _within_speeds(self, wanted: Twist) -> Twist:
        spec, separation = self._spec, self._setting.separation
        ahead, aside = _short((wanted.vx, wanted.vy), spec.linear)
        (turn,) = _short((wanted.wz,), spec.angular)
        limited = Twist(ahead, aside, turn)
        if not separation or (spec.left is None and spec.right is None):
            return limited
        left, right = side_speeds(limited, separation)
        (left,), (right,) = _short((left,), spec.left), _short((right,), spec.right)
        return twist_from_sides(left, right, limited.vy, separation)

    def _within_accelerations(self, before: Twist, wanted: Twist, seconds: float) -> Twist:
        spec = self._spec
        ahead, aside = _short((wanted.vx - before.vx, wanted.vy - before.vy), spec.linear_acceleration, seconds)
        (turn,) = _short((wanted.wz - before.wz,), spec.angular_acceleration, seconds)
        return Twist(before.vx + ahead, before.vy + aside, before.wz + turn)


def _short(vector: tuple[float, ...], limit: float | None, times: float = 1.0) -> tuple[float, ...]:
    """The vector, no longer than a limit times something."""
    length = math.hypot(*vector)
    if limit is None or length <= limit * times:
        return vector
    return tuple(value * limit * times / length for value in vector)
