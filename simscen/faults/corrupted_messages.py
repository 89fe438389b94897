"""Faults that replace the content of messages: `garbage` and `stuck`."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, ClassVar, Literal, TypeVar

import numpy as np

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import STOP, Twist
from simscen.core.messages.navigation import Belief
from simscen.core.messages.sensor_data import Image, Imu, Odometry, Reading, Scan
from simscen.faults.base import Disturbance, Fault, FaultSetting, Instance
from simscen.spec.base import Spec
from simscen.spec.quantities import Probability

if TYPE_CHECKING:
    import numpy.typing as npt

NUMBERS = {"nan": math.nan, "inf": math.inf, "zero": 0.0, "negative": -1.0, "huge": 1e30}
T = TypeVar("T", bound="np.generic")
SIZES = ("empty", "short")
What = Literal["nan", "inf", "zero", "negative", "huge", "empty", "short", "anything"]


class Garbage(Spec, Fault):
    """Messages that say nonsense: nan, inf, negative, huge or no values at all, or too few of them.

    Real drivers send them when they start, when a frame is cut off, or when a checksum is not looked at. A stack has
    to survive them; one that takes them for measurements drives by them.

    Example: `{sensor: lidar, garbage: {value: nan, probability: 20 %}}`
    """

    affects: ClassVar[frozenset[str]] = frozenset({"Scan", "Odometry", "Imu", "Image"})
    idle: ClassVar[Mapping[str, object]] = {"probability": 0.0}
    value: What = "anything"
    """What stands in all values of such a message: nan, inf, zero, negative (-1) or huge (1e30). A scan or image can be
    empty (no values at all) or short (half of them), too. Anything draws one of these for each message."""
    probability: Probability = 1.0
    """The chance that a message is garbage."""

    def senseless(self, instance: Instance) -> tuple[str, str] | None:
        """Sizes of what has none."""
        if self.value not in SIZES or instance.kind in ("Scan", "Image"):
            return None
        return "value", f"its messages cannot be {self.value}: they have a fixed number of values"

    def begin(self, chance: np.random.Generator, setting: FaultSetting) -> Disturbance:
        """Draw for each message."""
        return _Nonsense(chance, self)


class _Nonsense(Disturbance):
    def __init__(self, chance: np.random.Generator, garbage: Garbage) -> None:
        self._chance, self._garbage = chance, garbage

    def reading(self, reading: Reading) -> Reading | None:
        sized = isinstance(reading, Scan | Image)
        possible = (*NUMBERS, *(SIZES if sized else ()))
        drawn, which = self._chance.random(), possible[int(self._chance.integers(len(possible)))]
        if drawn >= self._garbage.probability:
            return reading
        what = which if self._garbage.value == "anything" else self._garbage.value
        match reading:
            case Scan(ranges=ranges):
                return replace(reading, ranges=_spoilt(ranges, what))
            case Image(rgb=rgb, depth=depth):
                colors = rgb if what in NUMBERS else _spoilt(rgb, what)
                return replace(reading, rgb=colors, depth=_spoilt(depth, what))
            case Odometry():
                value = NUMBERS[what]
                return replace(reading, pose=Pose2(value, value, value), twist=Twist(value, value, value))
            case Imu():
                three = (NUMBERS[what],) * 3
                return replace(reading, angular_velocity=three, linear_acceleration=three)
            case _:
                return reading


def _spoilt(values: npt.NDArray[T], what: str) -> npt.NDArray[T]:
    """The values, or rows of them, as a broken driver sends them."""
    sizes: dict[str, Callable[[], npt.NDArray[T]]] = {
        "empty": lambda: values[:0],
        "short": lambda: values[: len(values) // 2],
    }
    return sizes[what]() if what in sizes else np.full_like(values, NUMBERS[what])


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
