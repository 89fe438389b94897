"""Faults that replace the content of messages: `garbage` and `stuck`."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, ClassVar, Literal, TypeVar

import numpy as np

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import STOP, Twist
from simscen.core.messages.navigation import Belief
from simscen.core.messages.sensor_data import Image, Imu, Odometry, Reading, Scan
from simscen.faults.base import Fault, FaultEffect, FaultSetting, FaultTarget
from simscen.faults.common import ChangedReadings
from simscen.spec.base import Spec
from simscen.spec.quantities import Probability

if TYPE_CHECKING:
    import numpy.typing as npt

GARBAGE_NUMBERS = {"nan": math.nan, "inf": math.inf, "zero": 0.0, "negative": -1.0, "huge": 1e30}
"""Numbers that replace all measurements in a message, except colors, by keyword of `Garbage.value`."""
WRONG_SIZES = ("empty", "short")
"""Keywords of `Garbage.value` that change the number of values in a message."""
T = TypeVar("T", bound="np.generic")


class Garbage(Spec, Fault):
    """Messages with meaningless content: nan, inf, zero, negative, or huge values, no values, or too few values.

    Real drivers send garbage while they start, when a packet is cut off, or when a checksum is not verified. A stack
    must tolerate garbage and must not treat it as a measurement.

    Example: `{sensor: lidar, garbage: {value: nan, probability: 20 %}}`
    """

    affects: ClassVar[frozenset[str]] = frozenset({"Scan", "Odometry", "Imu", "Image"})
    neutral_values: ClassVar[Mapping[str, object]] = {"probability": 0.0}
    value: Literal["nan", "inf", "zero", "negative", "huge", "empty", "short", "anything"] = "anything"
    """Value of all measurements in the message, except colors: nan, inf, zero, negative (-1), or huge (1e30). A scan or
    image can also be empty (no values) or short (half of the values). `anything` draws one of these keywords for each
    message."""
    probability: Probability = 1.0
    """Probability that a message is garbage."""

    def unsuitable_key(self, target: FaultTarget) -> tuple[str, str] | None:
        if self.value not in WRONG_SIZES or target.kind in ("Scan", "Image"):
            return None
        return "value", f"its messages cannot be {self.value}: they have a fixed number of values"

    def begin(self, rng: np.random.Generator, setting: FaultSetting) -> FaultEffect:
        return ChangedReadings(lambda reading: self._replace_content(rng, reading))

    def _replace_content(self, rng: np.random.Generator, reading: Reading) -> Reading:
        has_variable_size = isinstance(reading, Scan | Image)
        contents = (*GARBAGE_NUMBERS, *(WRONG_SIZES if has_variable_size else ()))
        draw, random_content = rng.random(), contents[int(rng.integers(len(contents)))]
        if draw >= self.probability:
            return reading
        content = random_content if self.value == "anything" else self.value
        match reading:
            case Scan(ranges=ranges):
                return replace(reading, ranges=_garbage_values(ranges, content))
            case Image(rgb=rgb, depth=depth):
                colors = rgb if content in GARBAGE_NUMBERS else _garbage_values(rgb, content)
                return replace(reading, rgb=colors, depth=_garbage_values(depth, content))
            case Odometry():
                value = GARBAGE_NUMBERS[content]
                return replace(reading, pose=Pose2(value, value, value), twist=Twist(value, value, value))
            case Imu():
                vector = (GARBAGE_NUMBERS[content],) * 3
                return replace(reading, angular_velocity=vector, linear_acceleration=vector)
            case _:
                return reading


def _garbage_values(values: npt.NDArray[T], content: str) -> npt.NDArray[T]:
    """Return an empty array, the first half of `values`, or an array of the same shape filled with one number.

    `content` is a keyword of `Garbage.value`, except `anything`.
    """
    if content == "empty":
        return values[:0]
    if content == "short":
        return values[: len(values) // 2]
    return np.full_like(values, GARBAGE_NUMBERS[content])


class Stuck(Spec, Fault):
    """The same message is repeated with a fresh time stamp: a driver that hangs and sends its last buffer again.

    The repeated message is the first message after the start of the fault. On `cmd_vel`, the base repeats this command.
    On `localizer`, the navigator always receives the same pose. On `wheels`, the wheels are blocked.

    Example: `{sensor: lidar, stuck: {}, when: {time: 5 s}, for: 2 s}`
    """

    affects: ClassVar[frozenset[str]] = frozenset(
        {"Scan", "Odometry", "Imu", "Bump", "Image", "Command", "Wheels", "Belief"}
    )

    def begin(self, rng: np.random.Generator, setting: FaultSetting) -> FaultEffect:
        return _RepeatedMessage(STOP if setting.kind == "Wheels" else None)


class _RepeatedMessage(FaultEffect):
    """Effect of `stuck`: repeats the first message, or only `command` if it is not None."""

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
