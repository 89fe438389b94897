"""The fault `delay`: messages arrive late."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from typing import ClassVar, Generic, TypeVar

import numpy as np

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.navigation import Belief
from simscen.core.messages.sensor_data import Reading
from simscen.faults.base import Fault, FaultEffect, FaultSetting
from simscen.faults.common import replace_map_from_odom
from simscen.spec.base import Spec
from simscen.spec.quantities import Duration

T = TypeVar("T")


class Delay(Spec, Fault):
    """Messages arrive late and in order: a slow driver, or a busy bus or network.

    Messages keep the time stamp of their measurement. The delay is `latency` plus a random part of `jitter`, but no
    message overtakes an earlier message. Messages that are in transit when the fault ends still arrive, and before all
    later messages. On `localizer`, the transform from map to odom is late.

    Example: `{sensor: lidar, delay: {latency: 200 ms, jitter: 50 ms}}`
    """

    affects: ClassVar[frozenset[str]] = frozenset({"Scan", "Odometry", "Imu", "Bump", "Image", "Command", "Belief"})
    neutral_values: ClassVar[Mapping[str, object]] = {"latency": 0.0, "jitter": 0.0}
    latency: Duration = 0.0
    """Delay of every message."""
    jitter: Duration = 0.0
    """Maximum additional delay. The additional delay is drawn uniformly for each message."""

    def begin(self, rng: np.random.Generator, setting: FaultSetting) -> FaultEffect:
        return _DelayedMessages(rng, self, setting)


class _DelayedMessages(FaultEffect):
    """Effect of `delay`."""

    def __init__(self, rng: np.random.Generator, delay: Delay, setting: FaultSetting) -> None:
        self._rng, self._delay, self._setting = rng, delay, setting
        self._readings, self._commands = _TransitQueue[Reading](), _TransitQueue[Twist]()
        self._transforms = _TransitQueue[Pose2]()
        self._map_from_odom: Pose2 | None = None
        """The newest transform that has arrived."""
        self._has_ended = False

    def _due_tick(self) -> int:
        """Return the tick at which a message that is sent now arrives."""
        if self._has_ended:
            return self._setting.now()
        delay = self._delay.latency + self._delay.jitter * self._rng.random()
        return self._setting.now() + self._setting.clock.ticks(delay)

    def reading(self, reading: Reading) -> Reading | None:
        return self._readings.pass_or_hold(reading, self._due_tick(), self._setting.now())

    def arriving_readings(self) -> list[Reading]:
        return self._readings.pop_due(self._setting.now())

    def command(self, command: Twist) -> Twist | None:
        return self._commands.pass_or_hold(command, self._due_tick(), self._setting.now())

    def arriving_command(self) -> Twist | None:
        return next(reversed(self._commands.pop_due(self._setting.now())), None)

    def belief(self, belief: Belief) -> Belief:
        now, sent = self._setting.now(), belief.map_from_odom
        arrived = self._transforms.pop_due(now)
        if (undelayed := self._transforms.pass_or_hold(sent, self._due_tick(), now)) is not None:
            arrived.append(undelayed)
        self._map_from_odom = arrived[-1] if arrived else self._map_from_odom or sent
        return replace_map_from_odom(belief, self._map_from_odom)

    def end(self) -> FaultEffect | None:
        """Return this effect if messages are still in transit, otherwise None."""
        self._has_ended = True
        return self if self._readings or self._commands or self._transforms else None


class _TransitQueue(Generic[T]):
    """Queue of messages in transit, oldest first. All times are ticks."""

    def __init__(self) -> None:
        self._waiting: deque[tuple[int, T]] = deque()

    def __len__(self) -> int:
        return len(self._waiting)

    def pass_or_hold(self, message: T, due: int, now: int) -> T | None:
        """Return the message if it is due and the queue is empty. Otherwise, add it to the queue and return None."""
        if not self._waiting and due <= now:
            return message
        self._waiting.append((max(due, self._waiting[-1][0]) if self._waiting else due, message))
        return None

    def pop_due(self, now: int) -> list[T]:
        """Remove and return the messages that are due, oldest first."""
        due: list[T] = []
        while self._waiting and self._waiting[0][0] <= now:
            due.append(self._waiting.popleft()[1])
        return due
