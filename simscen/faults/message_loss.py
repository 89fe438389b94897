"""Faults that lose messages: `off`, `dropout`, `intermittent`, and `slow`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import ClassVar

import numpy as np

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.navigation import Belief
from simscen.core.messages.sensor_data import Reading
from simscen.faults.base import Fault, FaultEffect, FaultSetting, FaultTarget
from simscen.faults.common import replace_map_from_odom
from simscen.spec.base import Spec
from simscen.spec.quantities import Frequency, PositiveDuration, Probability

MESSAGE_KINDS = frozenset({"Scan", "Odometry", "Imu", "Bump", "Image", "Command"})
"""Kinds of targets that consist of messages: readings and velocity commands."""


class _MessageLoss(FaultEffect):
    """Effect that drops messages. If a belief is lost, the transform from map to odom keeps its last value.

    `is_lost` is called once for each message, and returns whether the message is lost.
    """

    def __init__(self, is_lost: Callable[[], bool]) -> None:
        self._is_lost = is_lost
        self._map_from_odom: Pose2 | None = None

    def reading(self, reading: Reading) -> Reading | None:
        return None if self._is_lost() else reading

    def command(self, command: Twist) -> Twist | None:
        return None if self._is_lost() else command

    def belief(self, belief: Belief) -> Belief:
        if not self._is_lost() or self._map_from_odom is None:
            self._map_from_odom = belief.map_from_odom
        return replace_map_from_odom(belief, self._map_from_odom)


class Off(Spec, Fault):
    """No message arrives any more, as if a cable came loose or a node died.

    A base that receives no command stops after its `command_timeout`. If the localizer is off, the robot continues by
    odometry: the transform from map to odom keeps its last value, as on /tf.

    Example: `{sensor: lidar, off: {}, when: {time: 10 s}, for: 3 s}`
    """

    affects: ClassVar[frozenset[str]] = MESSAGE_KINDS | {"Belief"}

    def begin(self, rng: np.random.Generator, setting: FaultSetting) -> FaultEffect:
        return _MessageLoss(lambda: True)


class Dropout(Spec, Fault):
    """Each message is lost with a fixed probability, independently of other messages, as on a bad radio link.

    A base that receives no command keeps the last command, and stops after its `command_timeout`.

    Example: `{sensor: lidar, dropout: {probability: 30 %}}`
    """

    affects: ClassVar[frozenset[str]] = MESSAGE_KINDS
    neutral_values: ClassVar[Mapping[str, object]] = {"probability": 0.0}
    probability: Probability
    """Probability that a message is lost."""

    def begin(self, rng: np.random.Generator, setting: FaultSetting) -> FaultEffect:
        return _MessageLoss(lambda: bool(rng.random() < self.probability))


class Intermittent(Spec, Fault):
    """Periods in which messages arrive alternate with gaps, as with a loose contact or a fading radio link.

    The lengths of periods and gaps are exponentially distributed (Gilbert, Capacity of a burst-noise channel, 1960). On
    average, the fraction down / (up + down) of all messages is lost. The fault begins with a gap.

    Example: `{sensor: lidar, intermittent: {up: 1 s, down: 0.5 s}}`
    """

    affects: ClassVar[frozenset[str]] = MESSAGE_KINDS | {"Belief"}
    up: PositiveDuration
    """Mean length of the periods in which messages arrive."""
    down: PositiveDuration
    """Mean length of the gaps, in which all messages are lost."""

    def begin(self, rng: np.random.Generator, setting: FaultSetting) -> FaultEffect:
        return _MessageLoss(_GilbertChannel(rng, self, setting).is_down)


class _GilbertChannel:
    """Channel that alternates between up and down, for exponentially distributed times. Down at first."""

    def __init__(self, rng: np.random.Generator, spec: Intermittent, setting: FaultSetting) -> None:
        self._rng, self._spec, self._setting = rng, spec, setting
        self._is_down = True
        self._next_change_s = setting.clock.seconds(setting.now()) + rng.exponential(spec.down)

    def is_down(self) -> bool:
        """Return whether messages are lost now."""
        now = self._setting.clock.seconds(self._setting.now())
        while self._next_change_s <= now:
            self._is_down = not self._is_down
            self._next_change_s += self._rng.exponential(self._spec.down if self._is_down else self._spec.up)
        return self._is_down


class Slow(Spec, Fault):
    """Messages arrive at a lower rate than normal: an overloaded computer, a sensor in its energy-saving mode.

    Only the first message in each period of 1 / `rate` arrives. All other messages are lost. A base that receives no
    command keeps the last command, and stops after its `command_timeout`.

    Example: `{sensor: lidar, slow: {rate: 2 Hz}}`
    """

    affects: ClassVar[frozenset[str]] = MESSAGE_KINDS | {"Belief"}
    rate: Frequency
    """Messages per second that arrive."""

    def unsuitable_key(self, target: FaultTarget) -> tuple[str, str] | None:
        if not target.rate or self.rate < target.rate:
            return None
        return "rate", f"{self.rate:g} Hz is not slower than its normal rate of {target.rate:g} messages per second"

    def begin(self, rng: np.random.Generator, setting: FaultSetting) -> FaultEffect:
        return _MessageLoss(_RateLimit(self.rate, setting).exceeds)


class _RateLimit:
    """Passes only the first message of each period. Periods are counted from the first message."""

    def __init__(self, rate: float, setting: FaultSetting) -> None:
        self._period_ticks, self._now = setting.clock.rate / rate, setting.now
        self._first_tick: int | None = None
        self._next_period = 0
        """Index of the earliest period in which another message may arrive."""

    def exceeds(self) -> bool:
        """Return whether a message that is sent now is lost, because an earlier one arrived in the same period."""
        now = self._now()
        if self._first_tick is None:
            self._first_tick = now
        if now - self._first_tick < self._next_period * self._period_ticks - 1e-6:
            return True
        self._next_period = int((now - self._first_tick) / self._period_ticks + 1e-6) + 1
        return False
