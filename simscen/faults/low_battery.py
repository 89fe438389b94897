"""`low_battery`: the base gets slower and slower."""

from __future__ import annotations

import math
from typing import ClassVar

import numpy as np
from pydantic import Field, model_validator

from simscen.core.geometry.kinematics import Twist
from simscen.faults.base import Disturbance, Fault, FaultSetting
from simscen.spec.base import Spec
from simscen.spec.quantities import Duration, PositiveSpeed


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
