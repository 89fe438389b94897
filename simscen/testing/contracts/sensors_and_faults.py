"""The promises of a fault."""

from __future__ import annotations

import copy
from collections.abc import Callable, Collection
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from simscen.core.clock import Clock
from simscen.core.environment.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from simscen.core.geometry import Array, Pose2, Pose3
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages import sensor_data
from simscen.core.messages.navigation import Belief
from simscen.core.messages.sensor_data import Bump, Image, Imu, Odometry, Reading, Scan
from simscen.core.records.events import BELIEF, COMMAND, MAP, WHEELS
from simscen.core.records.events import FAULT_TARGET_KINDS as EVERY
from simscen.faults.base import Disturbance, Fault, FaultSetting
from simscen.sensors.sensor import Sensor, SensorSetting
from simscen.testing.contracts.base import Contract, call_component, promise, require
from simscen.testing.fakes import DRIVE, FakeSensorView, SquareRoomRays

KINDS: dict[str, Callable[[int], Reading]] = {
    "Scan": lambda k: Scan("it", 24 * k, np.linspace(0.5, 5.0, 60) + 0.01 * k, -3.0, 0.1, 0.05, 8.0),
    "Odometry": lambda k: Odometry("it", 24 * k, Pose2(0.05 * k, 0.01 * k, 0.02 * k), Twist(0.5, 0.0, 0.2)),
    "Imu": lambda k: Imu("it", 24 * k, (0.0, 0.0, 0.2), (0.1, 0.0, 9.81)),
    "Bump": lambda k: Bump("it", 24 * k, k % 2 == 0),
    "Image": lambda k: Image("it", 24 * k, np.full((4, 6, 3), k % 200, np.uint8), np.full((4, 6), 2.0, np.float32)),
}
COUNT = 40
GRID = OccupancyGrid(np.where(np.eye(20, dtype=bool), OCCUPIED, FREE).astype(np.int8), 0.25)


class Elsewhere:
    """What is seen from elsewhere, or through something: two meters more, and another picture."""

    def distances(self, scan: Scan, error: Pose3 | None = None, without: Collection[str] = ()) -> Array:
        """Straight ahead a wall, for want of a world."""
        return np.full(len(scan.ranges), 2.0 if error is None and not without else 4.0)

    def image(self, error: Pose3) -> Image:
        """Gray."""
        return Image("it", 0, np.full((4, 6, 3), 90, np.uint8), np.full((4, 6), 3.0, np.float32))


@dataclass(frozen=True, eq=False)
class FaultContract(Contract):
    """Tried on forty readings or commands of each kind that it affects."""

    role = "fault"
    spec: Any
    subject: str = ""

    def begun(self, kind: str, now: Callable[[], int] = lambda: 0) -> Disturbance:
        """A new one at work on a kind of instance, with the same generator each time."""
        fault: Fault = self.spec
        setting = FaultSetting(0.3, now=now, kind=kind, sight=Elsewhere() if kind in ("Scan", "Image") else None)
        return call_component("begins", fault.begin, np.random.default_rng(5), setting)

    def disturbed(self, kind: str) -> list[Any]:
        """What it makes of readings or commands of a kind, with what it kept back where that arrives."""
        tick = 0
        answers: list[Any] = []
        work = self.begun(kind, lambda: tick)
        for k in range(COUNT):
            tick = 24 * k
            if kind in (COMMAND, WHEELS):
                answers.append(call_component("is asked for a late command", work.arriving_command))
                answers.append(call_component("is handed a command", work.command, Twist(0.4, 0.0, 0.1 * (k % 5))))
            elif kind == BELIEF:
                answers.append(call_component("is handed a belief", work.belief, _belief(k)))
            elif kind == MAP:
                answers.append(call_component("is handed a map", work.map, GRID))
            else:
                answers += call_component("is asked for what arrives", work.arriving)
                answers.append(call_component(f"is handed a {kind}", work.reading, KINDS[kind](k)))
        return answers

    @promise
    def it_says_what_it_affects(self) -> None:
        """Given a fault then `affects` are kinds of readings that there are, or Command, and at least one."""
        affects = self.spec.affects
        require(affects, "affects nothing")
        strange = sorted(set(affects) - set(EVERY))
        require(not strange, f"affects {strange}, which there is not")

    @promise
    def it_answers_with_the_same_kind_or_none(self) -> None:
        """Given a reading then one of the same kind and sensor answers, or None; given a command a Twist, and so on.

        A command may be kept back on cmd_vel only; a belief and a map are always answered.
        """
        for kind in sorted(self.spec.affects):
            for answer in self.disturbed(kind):
                if kind in (COMMAND, WHEELS):
                    fine = answer is None or (isinstance(answer, Twist) and bool(np.isfinite(answer).all()))
                elif kind == BELIEF:
                    fine = isinstance(answer, Belief) and bool(np.isfinite(answer.pose).all())
                elif kind == MAP:
                    fine = isinstance(answer, OccupancyGrid)
                else:
                    asked = KINDS[kind](0)
                    fine = answer is None or (type(answer) is type(asked) and answer.sensor == asked.sensor)
                require(fine, f"makes {answer!r} of a {kind}")

    @promise
    def the_same_generator_gives_the_same_answers_bit_for_bit(self) -> None:
        """Given the same readings and generator then the same answers: no clock, no global chance."""
        for kind in sorted(self.spec.affects):
            one, other = (self.disturbed(kind) for _ in range(2))
            require(all(map(equal, one, other)), f"disturbs the same {kind} in two ways")

    @promise
    def a_reading_is_never_changed(self) -> None:
        """Given a reading then it stays what it is: the log keeps it, and the answer is another one."""
        for kind in sorted(set(self.spec.affects) & set(KINDS)):
            work = self.begun(kind)
            for k in range(COUNT):
                reading = KINDS[kind](k)
                before = copy.deepcopy(reading)
                call_component(f"is handed a {kind}", work.reading, reading)
                require(equal(reading, before), f"changes the {kind} that it was handed")

    @promise
    def its_end_leaves_a_disturbance_or_nothing(self) -> None:
        """Given the end of a fault then what stays is a Disturbance, or None."""
        for kind in sorted(self.spec.affects):
            left = call_component("ends", self.begun(kind).end)
            require(left is None or isinstance(left, Disturbance), f"leaves {left!r}")


def equal(one: Any, other: Any) -> bool:
    """Whether two readings, or two commands, are the same to the last bit."""
    if one is None or isinstance(one, tuple):
        return bool(one == other)
    return type(one) is type(other) and all(
        np.array_equal(a, b, equal_nan=a.dtype.kind == "f") if isinstance(a, np.ndarray) else a == b
        for a, b in ((getattr(one, f.name), getattr(other, f.name)) for f in fields(one))
    )


def _belief(number: int) -> Belief:
    pose, odometry = Pose2(1.0 + 0.05 * number, 2.0, 0.02 * number), Pose2(0.05 * number, 0.0, 0.02 * number)
    return Belief(pose, 0.01 * np.eye(3), pose.compose(odometry.inverse()), updated=24 * number)


NAME = "it"
READING_COUNT = 20
MAY_BE_MISSING = ("ranges", "depth")


@dataclass(frozen=True, eq=False)
class SensorContract(Contract):
    """Tried on a robot with two wheels that drives a circle in a square room."""

    role = "sensor"
    spec: Any
    subject: str = ""

    def readings(self, seed: int = 1) -> list[Reading]:
        """Twenty readings of a new one."""
        return self.measured(*self.built(seed))

    def built(self, seed: int = 1) -> tuple[Sensor, FakeSensorView, int]:
        """A new one, what it looks at, and ticks between two readings."""
        clock, view = Clock(240), FakeSensorView()
        period, rng = clock.period(self.spec.rate), np.random.default_rng(seed)
        setting = SensorSetting(NAME, period, clock.seconds(period), rng, view, SquareRoomRays(), DRIVE)
        return call_component("is built", lambda: self.spec.implementation()(self.spec, setting)), view, period

    def measured(self, sensor: Sensor, view: FakeSensorView, period: int) -> list[Reading]:
        """The next twenty readings."""
        taken = []
        for k in range(1, READING_COUNT + 1):
            view.seconds = k * period / 240
            taken.append(call_component("reads", sensor.read, k * period))
        return taken

    @promise
    def it_says_what_it_says_it_says(self) -> None:
        """Given a reading then it is of the kind of its specification, with the sensor's own name and the tick."""
        sensor, view, period = self.built()
        require(sensor.name == NAME, f"is called {sensor.name!r}, not {NAME!r}")
        require(sensor.period == period, f"has a period of {sensor.period!r} ticks, not {period}")
        kind = getattr(sensor_data, self.spec.reading_type)
        for k, reading in enumerate(self.measured(sensor, view, period), start=1):
            require(type(reading) is kind, f"returns {type(reading).__name__}, not {self.spec.reading_type}")
            signed = (reading.sensor, reading.tick)
            require(signed == (NAME, k * period), f"signs a reading of tick {k * period} as {signed}")

    @promise
    def what_it_says_are_numbers(self) -> None:
        """Given a reading then its numbers are finite, but for ranges and depths that may be missing."""
        for reading in self.readings():
            for field in fields(reading):
                value = getattr(reading, field.name)
                if isinstance(value, str | bool) or field.name in MAY_BE_MISSING:
                    continue
                require(np.isfinite(np.asarray(value, dtype=np.float64)).all(), f"says {field.name} of {value!r}")

    @promise
    def the_same_world_and_generator_give_the_same_readings_bit_for_bit(self) -> None:
        """Given the same world and generator then the same readings: no clock, no global chance."""
        one, other = self.readings(), self.readings()
        require(all(map(equal, one, other)), "measures the same world in two ways")

    @promise
    def a_reading_does_not_change_after_it_was_given(self) -> None:
        """Given a reading then nothing that is measured later changes it."""
        sensor, view, period = self.built()
        first = self.measured(sensor, view, period)
        kept = copy.deepcopy(first)
        self.measured(sensor, view, period)
        require(all(map(equal, first, kept)), "a reading changes when the next one is taken")
