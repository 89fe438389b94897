"""`slow`: messages come at another rate."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.navigation import Belief
from simscen.core.messages.sensor_data import Reading
from simscen.faults.base import Disturbance, Fault, FaultSetting, Instance
from simscen.faults.common import apply_correction
from simscen.spec.base import Spec
from simscen.spec.quantities import Frequency


class Slow(Spec, Fault):
    """Fewer messages come than should: an overloaded computer, a sensor in its energy-saving mode.

    The first comes through, then the first of each further period; all others are lost. Of cmd_vel the base keeps the
    last command, and stops after its `command_timeout`; the localizer corrects the odometry less often.

    Example: `{sensor: lidar, slow: {rate: 2 Hz}}`
    """

    affects: ClassVar[frozenset[str]] = frozenset({"Scan", "Odometry", "Imu", "Bump", "Image", "Command", "Belief"})
    rate: Frequency
    """Messages a second that come through."""

    def senseless(self, instance: Instance) -> tuple[str, str] | None:
        """A rate that is not lower than the instance's own."""
        if not instance.rate or self.rate < instance.rate:
            return None
        return "rate", f"{self.rate:g} Hz is not slow: {instance.rate:g} messages a second are all there are"

    def begin(self, chance: np.random.Generator, setting: FaultSetting) -> Disturbance:
        """With the next message."""
        return _Seldom(self.rate, setting)


class _Seldom(Disturbance):
    def __init__(self, rate: float, setting: FaultSetting) -> None:
        self._period, self._now = setting.clock.rate / rate, setting.now
        self._first: int | None = None
        self._let = 0
        self._correction: Pose2 | None = None

    def _due(self) -> bool:
        now = self._now()
        if self._first is None:
            self._first = now
        if now - self._first < self._let * self._period - 1e-6:
            return False
        self._let = int((now - self._first) / self._period + 1e-6) + 1
        return True

    def reading(self, reading: Reading) -> Reading | None:
        return reading if self._due() else None

    def command(self, command: Twist) -> Twist | None:
        return command if self._due() else None

    def belief(self, belief: Belief) -> Belief:
        if self._due() or self._correction is None:
            self._correction = belief.map_from_odom
        return apply_correction(belief, self._correction)
