"""`stuck`: always the same."""

from __future__ import annotations

from dataclasses import replace
from typing import ClassVar

import numpy as np

from simscen.core.geometry.kinematics import STOP, Twist
from simscen.core.messages.navigation import Belief
from simscen.core.messages.sensor_data import Reading
from simscen.faults.base import Disturbance, Fault, FaultSetting
from simscen.spec.base import Spec


class Stuck(Spec, Fault):
    """The same message again and again, with a fresh stamp: a driver that hangs and repeats its last buffer.

    It is the first message after the fault began. On cmd_vel the base keeps that command, whatever the stack says; on
    the localizer the navigator is told to be at one place; wheels are blocked.

    Example: `{sensor: lidar, stuck: {}, when: {time: 5 s}, for: 2 s}`
    """

    affects: ClassVar[frozenset[str]] = frozenset(
        {"Scan", "Odometry", "Imu", "Bump", "Image", "Command", "Wheels", "Belief"}
    )

    def begin(self, chance: np.random.Generator, setting: FaultSetting) -> Disturbance:
        """With what comes next."""
        return _Repeated(STOP if setting.kind == "Wheels" else None)


class _Repeated(Disturbance):
    def __init__(self, command: Twist | None) -> None:
        self._command = command
        self._reading: Reading | None = None
        self._belief: Belief | None = None

    def reading(self, reading: Reading) -> Reading | None:
        if self._command is not None:
            return reading
        if self._reading is None:
            self._reading = reading
        return replace(self._reading, tick=reading.tick)

    def command(self, command: Twist) -> Twist | None:
        if self._command is None:
            self._command = command
        return self._command

    def belief(self, belief: Belief) -> Belief:
        if self._belief is None:
            self._belief = belief
        return self._belief
