"""Faults of wheels and motors: `slip`, `gain`, `saturation`, and `low_battery`."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field, model_validator

from simscen.core.geometry.kinematics import Twist
from simscen.faults.base import Disturbance, Fault, FaultSetting, Instance
from simscen.faults.common import OdometryDistortion, inapplicable_side, side_speeds, twist_from_sides
from simscen.spec.base import Spec
from simscen.spec.quantities import Duration, PositiveAcceleration, PositiveAngularAcceleration, PositiveSpeed, Quantity

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


class LowBattery(Spec, Fault):
    """The top speed falls as the battery drains: motors turn no faster than its voltage lets them, untold to the stack.

    The limit falls evenly from `start` to `end` within `drain`, and stays there. Commands above it are scaled down,
    turn rate and all: the robot drives the same curves more slowly. Odometry measures what is really driven.

    Example: `{sensor: cmd_vel, low_battery: {start: 0.4 m/s, end: 0.15 m/s, drain: 20 s}}`
    """

    affects: ClassVar[frozenset[str]] = frozenset({"Command"})
    start: PositiveSpeed
    """The top speed when the fault begins."""
    end: PositiveSpeed
    """The top speed when the battery is as good as empty."""
    drain: Duration = Field(default=0.0)
    """How long it takes to get there; 0 = it is that low from the start."""

    @model_validator(mode="after")
    def _drains(self) -> LowBattery:
        if self.end > self.start:
            raise ValueError("`end` is above `start`: no battery charges itself")
        return self

    def begin(self, chance: np.random.Generator, setting: FaultSetting) -> Disturbance:
        """It drains from now on."""
        return _Draining(self, setting)


class _Draining(Disturbance):
    def __init__(self, spec: LowBattery, setting: FaultSetting) -> None:
        self._spec, self._setting, self._since = spec, setting, setting.now()

    def command(self, command: Twist) -> Twist | None:
        speed, most = math.hypot(command.vx, command.vy), self._most()
        if speed <= most:
            return command
        return Twist(*(value * most / speed for value in command))

    def _most(self) -> float:
        spec, seconds = self._spec, self._setting.clock.seconds(self._setting.now() - self._since)
        drained = min(1.0, seconds / spec.drain) if spec.drain > 0 else 1.0
        return spec.start + (spec.end - spec.start) * drained
