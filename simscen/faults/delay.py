"""`delay`: messages come late."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from typing import ClassVar, Generic, TypeVar

import numpy as np

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.navigation import Belief
from simscen.core.messages.sensor_data import Reading
from simscen.faults.base import Disturbance, Fault, FaultSetting
from simscen.faults.common import apply_correction
from simscen.spec.base import Spec
from simscen.spec.quantities import Duration

T = TypeVar("T")


class Delay(Spec, Fault):
    """Messages arrive late, in order: a slow driver, a bus or a network that is busy.

    A message arrives at the first beat at or after its time, stamped with when it was measured. Each takes `latency`
    and a random part of `jitter` besides, but none overtakes the one before it. What is under way when the fault ends
    still arrives, and holds up what comes after it. Of the localizer the correction of the odometry comes late.

    Example: `{sensor: lidar, delay: {latency: 200 ms, jitter: 50 ms}}`
    """

    affects: ClassVar[frozenset[str]] = frozenset({"Scan", "Odometry", "Imu", "Bump", "Image", "Command", "Belief"})
    idle: ClassVar[Mapping[str, object]] = {"latency": 0.0, "jitter": 0.0}
    latency: Duration = 0.0
    """What every message takes."""
    jitter: Duration = 0.0
    """What a message may take besides; drawn uniformly."""

    def begin(self, chance: np.random.Generator, setting: FaultSetting) -> Disturbance:
        """With the next message."""
        return _Late(chance, self, setting)


class _Late(Disturbance):
    def __init__(self, chance: np.random.Generator, delay: Delay, setting: FaultSetting) -> None:
        self._chance, self._delay, self._setting = chance, delay, setting
        self._readings, self._commands = _Line[Reading](), _Line[Twist]()
        self._corrections = _Line[Pose2]()
        self._correction: Pose2 | None = None
        self._over = False

    def _due(self) -> int:
        if self._over:
            return self._setting.now()
        late = self._delay.latency + self._delay.jitter * self._chance.random()
        return self._setting.now() + self._setting.clock.ticks(late)

    def reading(self, reading: Reading) -> Reading | None:
        return self._readings.pass_on(reading, self._due(), self._setting.now())

    def arriving(self) -> list[Reading]:
        return self._readings.take(self._setting.now())

    def command(self, command: Twist) -> Twist | None:
        return self._commands.pass_on(command, self._due(), self._setting.now())

    def arriving_command(self) -> Twist | None:
        return next(reversed(self._commands.take(self._setting.now())), None)

    def belief(self, belief: Belief) -> Belief:
        now, newest = self._setting.now(), belief.map_from_odom
        arrived = self._corrections.take(now)
        if (fresh := self._corrections.pass_on(newest, self._due(), now)) is not None:
            arrived.append(fresh)
        self._correction = arrived[-1] if arrived else self._correction or newest
        return apply_correction(belief, self._correction)

    def end(self) -> Disturbance | None:
        """What is under way still arrives."""
        self._over = True
        return self if self._readings or self._commands or self._corrections else None


class _Line(Generic[T]):
    """Messages under way, none of which overtakes another."""

    def __init__(self) -> None:
        self._waiting: deque[tuple[int, T]] = deque()

    def __len__(self) -> int:
        return len(self._waiting)

    def pass_on(self, message: T, due: int, now: int) -> T | None:
        """The message, if nothing is before it and it is due now; else it waits."""
        if not self._waiting and due <= now:
            return message
        self._waiting.append((max(due, self._waiting[-1][0]) if self._waiting else due, message))
        return None

    def take(self, now: int) -> list[T]:
        """What is due, oldest first."""
        taken: list[T] = []
        while self._waiting and self._waiting[0][0] <= now:
            taken.append(self._waiting.popleft()[1])
        return taken
