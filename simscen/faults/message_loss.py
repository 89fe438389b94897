"""Faults that lose messages: `off`, `dropout`, `intermittent`, and `slow`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.navigation import Belief
from simscen.core.messages.sensor_data import Reading
from simscen.faults.base import Disturbance, Fault, FaultSetting, Instance
from simscen.faults.common import apply_correction
from simscen.spec.base import Spec
from simscen.spec.quantities import Frequency, PositiveDuration, Probability


class Off(Spec, Fault):
    """No message arrives any more, as when a cable comes loose or a node dies.

    A base that hears no command stops after its `command_timeout`. Without its localizer a robot goes on by odometry:
    the correction from map to odometry stays what it was, as it does on /tf.

    Example: `{sensor: lidar, off: {}, when: {time: 10 s}, for: 3 s}`
    """

    affects: ClassVar[frozenset[str]] = frozenset({"Scan", "Odometry", "Imu", "Bump", "Image", "Command", "Belief"})

    def begin(self, chance: np.random.Generator, setting: FaultSetting) -> Disturbance:
        """Silence."""
        return _Silence()


class _Silence(Disturbance):
    def __init__(self) -> None:
        self._correction: Pose2 | None = None

    def reading(self, reading: Reading) -> Reading | None:
        return None

    def command(self, command: Twist) -> Twist | None:
        return None

    def belief(self, belief: Belief) -> Belief:
        if self._correction is None:
            self._correction = belief.map_from_odom
        return apply_correction(belief, self._correction)


class Dropout(Spec, Fault):
    """Each message is lost with a probability, independently of the others, as over a bad radio link.

    A base that hears no command keeps the last one, and stops after its `command_timeout`.

    Example: `{sensor: lidar, dropout: {probability: 30 %}}`
    """

    affects: ClassVar[frozenset[str]] = frozenset({"Scan", "Odometry", "Imu", "Bump", "Image", "Command"})
    idle: ClassVar[Mapping[str, object]] = {"probability": 0.0}
    probability: Probability
    """The chance that a message is lost."""

    def begin(self, chance: np.random.Generator, setting: FaultSetting) -> Disturbance:
        """Draw once for each message."""
        return _Loss(chance, self.probability)


class _Loss(Disturbance):
    def __init__(self, chance: np.random.Generator, probability: float) -> None:
        self._chance, self._probability = chance, probability

    def _lost(self) -> bool:
        return bool(self._chance.random() < self._probability)

    def reading(self, reading: Reading) -> Reading | None:
        return None if self._lost() else reading

    def command(self, command: Twist) -> Twist | None:
        return None if self._lost() else command


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
