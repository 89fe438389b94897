"""`intermittent`: a loose contact."""

from __future__ import annotations

from typing import ClassVar

import numpy as np

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.navigation import Belief
from simscen.core.messages.sensor_data import Reading
from simscen.faults.base import Disturbance, Fault, FaultSetting
from simscen.faults.common import apply_correction
from simscen.spec.base import Spec
from simscen.spec.quantities import PositiveDuration


class Intermittent(Spec, Fault):
    """Messages come and stay away in turns of random length, as with a loose contact or a radio link with fading.

    The turns have exponential lengths (a Gilbert channel: Gilbert, Capacity of a burst-noise channel, 1960), so that
    in the long run the share down / (up + down) is lost, in bursts. It begins with a gap.

    Example: `{sensor: lidar, intermittent: {up: 1 s, down: 0.5 s}}`
    """

    affects: ClassVar[frozenset[str]] = frozenset({"Scan", "Odometry", "Imu", "Bump", "Image", "Command", "Belief"})
    up: PositiveDuration
    """Mean time for which messages come."""
    down: PositiveDuration
    """Mean time for which they stay away."""

    def begin(self, chance: np.random.Generator, setting: FaultSetting) -> Disturbance:
        """With a gap."""
        return _LooseContact(chance, self, setting)


class _LooseContact(Disturbance):
    def __init__(self, chance: np.random.Generator, spec: Intermittent, setting: FaultSetting) -> None:
        self._chance, self._spec, self._setting = chance, spec, setting
        self._gap = True
        self._correction: Pose2 | None = None
        self._until = setting.clock.seconds(setting.now()) + chance.exponential(spec.down)

    def _away(self) -> bool:
        now = self._setting.clock.seconds(self._setting.now())
        while self._until <= now:
            self._gap = not self._gap
            self._until += self._chance.exponential(self._spec.down if self._gap else self._spec.up)
        return self._gap

    def reading(self, reading: Reading) -> Reading | None:
        return None if self._away() else reading

    def command(self, command: Twist) -> Twist | None:
        return None if self._away() else command

    def belief(self, belief: Belief) -> Belief:
        if self._correction is None or not self._away():
            self._correction = belief.map_from_odom
        return apply_correction(belief, self._correction)
