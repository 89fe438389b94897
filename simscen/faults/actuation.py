"""Faults of wheels and motors: `slip`, `gain`, `saturation`, and `low_battery`."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, ClassVar

import numpy as np
from pydantic import Field, model_validator

from simscen.core.geometry.kinematics import Twist
from simscen.faults.base import Fault, FaultEffect, FaultSetting, FaultTarget
from simscen.faults.common import ChangedCommands, OdometryDistortion
from simscen.spec.base import Spec
from simscen.spec.quantities import Duration, PositiveAcceleration, PositiveAngularAcceleration, PositiveSpeed, Quantity

SlipRatio = Annotated[float, Field(ge=0, lt=1), Quantity("ratio")]
"""Slip ratio s = 1 - v / (ω r); see Slip."""
GainFactor = Annotated[float, Field(ge=-10, le=10), Quantity("ratio")]
"""Ratio of driven to commanded velocity."""
SpeedLimit = Annotated[float, Field(ge=0, le=100), Quantity("speed")]
"""Maximum speed in m/s; 0 blocks the motion."""
TurnRateLimit = Annotated[float, Field(ge=0, le=100), Quantity("angular speed")]
"""Maximum turn rate in rad/s; 0 blocks the rotation."""


def side_speeds(motion: Twist, wheel_separation: float) -> tuple[float, float]:
    """Return the rolling speeds (left, right) in m/s of the wheels without slip. `wheel_separation` is in m."""
    half = wheel_separation / 2
    return motion.vx - half * motion.wz, motion.vx + half * motion.wz


def twist_from_sides(left: float, right: float, lateral: float, wheel_separation: float) -> Twist:
    """Return the velocity of the base, given the speeds of the left and right wheels and the lateral speed in m/s."""
    return Twist((left + right) / 2, lateral, (right - left) / wheel_separation)


def inapplicable_side(fault: Gain | Saturation, target: FaultTarget) -> tuple[str, str] | None:
    """Return (key, reason) if `left` or `right` is set, but the target has no left and right wheels; otherwise None."""
    given = [key for key in ("left", "right") if key in fault.model_fields_set and getattr(fault, key) is not None]
    if given and target.kind != "Wheels":
        return given[0], f"`{given[0]}` does not apply there: a command has no sides; set it on `wheels`"
    if given and target.spec is not None and not getattr(target.spec, "wheel_separation", 0.0):
        return given[0], f"`{given[0]}` does not apply there: this drive has no left and right wheels"
    return None


class Slip(Spec, Fault):
    """Wheels slip: the robot moves less than its wheels roll, but the odometry counts the full roll of the wheels.

    The slip ratio is s = 1 - v / (ω r), as in vehicle dynamics (Wong, Theory of Ground Vehicles, ch. 2). With different
    ratios for left and right, the robot also turns, and the odometry does not measure this turn. The robot slips with
    both targets. On `wheels`, all wheel odometry is wrong; on an odometry sensor, only the readings of this sensor.

    Example: `{sensor: odom, slip: {left: 30 %, right: 10 %}, when: {time: 5 s}, for: 4 s}`
    """

    affects: ClassVar[frozenset[str]] = frozenset({"Odometry", "Wheels"})
    neutral_values: ClassVar[Mapping[str, object]] = {"left": 0.0, "right": 0.0}
    left: SlipRatio = 0.0
    """Slip ratio of the left wheels."""
    right: SlipRatio = 0.0
    """Slip ratio of the right wheels."""

    def begin(self, rng: np.random.Generator, setting: FaultSetting) -> FaultEffect:
        return _SlippingWheels(self, setting.separation)


class _SlippingWheels(OdometryDistortion):
    """Effect of `slip`."""

    changes_motion = True

    def __init__(self, slip: Slip, separation: float) -> None:
        self._left_ratio, self._right_ratio, self._separation = 1 - slip.left, 1 - slip.right, separation
        inverse = 1 / self._left_ratio, 1 / self._right_ratio
        super().__init__(
            lambda step, velocity, _: (self._scale_sides(step, *inverse), self._scale_sides(velocity, *inverse))
        )

    def command(self, command: Twist) -> Twist | None:
        return command if self._has_ended else self._scale_sides(command, self._left_ratio, self._right_ratio)

    def _scale_sides(self, motion: Twist, left: float, right: float) -> Twist:
        """Return the motion with the speeds of the left and right wheels multiplied by `left` and `right`."""
        left_speed, right_speed = side_speeds(motion, self._separation)
        left_speed, right_speed = left_speed * left, right_speed * right
        lateral = motion.vy * (left + right) / 2
        if not self._separation:
            return Twist((left_speed + right_speed) / 2, lateral, motion.wz * (left + right) / 2)
        return twist_from_sides(left_speed, right_speed, lateral, self._separation)


class Gain(Spec, Fault):
    """The base drives a multiple of the commanded velocity: wrong scaling in the driver, worn motor brushes.

    On `wheels`, each side can be scaled separately, so that the robot pulls to the weaker side. Odometry measures the
    actual motion. A negative gain is a motor with reversed polarity.

    Example: `{sensor: wheels, gain: {left: 80 %}}`
    """

    affects: ClassVar[frozenset[str]] = frozenset({"Command", "Wheels"})
    neutral_values: ClassVar[Mapping[str, object]] = dict.fromkeys(("linear", "angular", "left", "right"), 1.0)
    linear: GainFactor = 1.0
    """Ratio of driven to commanded linear velocity, forward and lateral."""
    angular: GainFactor = 1.0
    """Ratio of driven to commanded angular velocity."""
    left: GainFactor = 1.0
    """Ratio of driven to commanded speed of the left wheels; only on `wheels`."""
    right: GainFactor = 1.0
    """Ratio of driven to commanded speed of the right wheels; only on `wheels`."""

    def unsuitable_key(self, target: FaultTarget) -> tuple[str, str] | None:
        return inapplicable_side(self, target)

    def begin(self, rng: np.random.Generator, setting: FaultSetting) -> FaultEffect:
        def scale(command: Twist) -> Twist:
            twist = Twist(self.linear * command.vx, self.linear * command.vy, self.angular * command.wz)
            if not setting.separation or self.left == self.right == 1:
                return twist
            left, right = side_speeds(twist, setting.separation)
            return twist_from_sides(self.left * left, self.right * right, twist.vy, setting.separation)

        return ChangedCommands(scale)


class Saturation(Spec, Fault):
    """The maximum speeds and accelerations are reduced: a motor that is too weak or too hot.

    On `wheels`, each side can be limited separately, so that the robot turns towards the weaker side at high speed.
    Odometry measures the actual motion.

    Example: `{sensor: wheels, saturation: {left: 0.2 m/s}}`
    """

    affects: ClassVar[frozenset[str]] = frozenset({"Command", "Wheels"})
    neutral_values: ClassVar[Mapping[str, object]] = dict.fromkeys(
        ("linear", "angular", "linear_acceleration", "angular_acceleration", "left", "right")
    )
    linear: SpeedLimit | None = None
    """Maximum speed over ground, in any direction."""
    angular: TurnRateLimit | None = None
    """Maximum angular speed."""
    linear_acceleration: PositiveAcceleration | None = None
    """Maximum acceleration and deceleration."""
    angular_acceleration: PositiveAngularAcceleration | None = None
    """Maximum angular acceleration and deceleration."""
    left: SpeedLimit | None = None
    """Maximum speed of the left wheels in both directions; only on `wheels`."""
    right: SpeedLimit | None = None
    """Maximum speed of the right wheels in both directions; only on `wheels`."""

    def unsuitable_key(self, target: FaultTarget) -> tuple[str, str] | None:
        return inapplicable_side(self, target)

    def begin(self, rng: np.random.Generator, setting: FaultSetting) -> FaultEffect:
        return _LimitedCommands(self, setting)


class _LimitedCommands(FaultEffect):
    """Effect of `saturation`."""

    def __init__(self, spec: Saturation, setting: FaultSetting) -> None:
        self._spec, self._setting = spec, setting
        self._tick, self._previous = setting.now(), setting.command

    def command(self, command: Twist) -> Twist | None:
        seconds = self._setting.seconds_since(self._tick)
        self._previous = self._limit_accelerations(self._previous, self._limit_speeds(command), seconds)
        self._tick = self._setting.now()
        return self._previous

    def _limit_speeds(self, command: Twist) -> Twist:
        """Return the command with limited speeds of the base and of each side."""
        spec, separation = self._spec, self._setting.separation
        vx, vy = _limit_length((command.vx, command.vy), spec.linear)
        (wz,) = _limit_length((command.wz,), spec.angular)
        limited = Twist(vx, vy, wz)
        if not separation or (spec.left is None and spec.right is None):
            return limited
        left, right = side_speeds(limited, separation)
        (left,), (right,) = _limit_length((left,), spec.left), _limit_length((right,), spec.right)
        return twist_from_sides(left, right, limited.vy, separation)

    def _limit_accelerations(self, previous: Twist, command: Twist, seconds: float) -> Twist:
        """Return the command with a limited change from the `previous` one, `seconds` earlier."""
        spec = self._spec
        vx, vy = _limit_length((command.vx - previous.vx, command.vy - previous.vy), spec.linear_acceleration, seconds)
        (wz,) = _limit_length((command.wz - previous.wz,), spec.angular_acceleration, seconds)
        return Twist(previous.vx + vx, previous.vy + vy, previous.wz + wz)


def _limit_length(vector: tuple[float, ...], limit: float | None, seconds: float = 1.0) -> tuple[float, ...]:
    """Return the vector, shortened to the length `limit * seconds` if it is longer. None is no limit."""
    length = math.hypot(*vector)
    if limit is None or length <= limit * seconds:
        return vector
    return tuple(value * limit * seconds / length for value in vector)


class LowBattery(Spec, Fault):
    """The maximum speed falls as the battery drains and the motor voltage drops; the stack is not informed.

    The maximum speed falls linearly from `start` to `end` during the time `drain`, and then stays constant. Linear and
    angular velocity of faster commands are reduced by the same factor, so that the robot drives the same curves more
    slowly. Odometry measures the actual motion.

    Example: `{sensor: cmd_vel, low_battery: {start: 0.4 m/s, end: 0.15 m/s, drain: 20 s}}`
    """

    affects: ClassVar[frozenset[str]] = frozenset({"Command"})
    start: PositiveSpeed
    """Maximum speed when the fault begins."""
    end: PositiveSpeed
    """Maximum speed after the time `drain`."""
    drain: Duration = Field(default=0.0)
    """Time until the maximum speed has fallen to `end`; 0 = at once."""

    @model_validator(mode="after")
    def _require_end_at_most_start(self) -> LowBattery:
        if self.end > self.start:
            raise ValueError("`end` is above `start`: a battery does not charge itself")
        return self

    def begin(self, rng: np.random.Generator, setting: FaultSetting) -> FaultEffect:
        start_tick = setting.now()

        def limit_speed(command: Twist) -> Twist:
            drained_ratio = min(1.0, setting.seconds_since(start_tick) / self.drain) if self.drain > 0 else 1.0
            speed, max_speed = math.hypot(command.vx, command.vy), self.start + (self.end - self.start) * drained_ratio
            return command if speed <= max_speed else Twist(*(value * max_speed / speed for value in command))

        return ChangedCommands(limit_speed)
