"""Contracts of sensors and faults: checks that each of them must pass."""

from __future__ import annotations

import copy
from collections.abc import Callable, Collection
from dataclasses import fields
from typing import Any

import numpy as np

from simscen.core.clock import Clock
from simscen.core.environment.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from simscen.core.geometry import Array, Pose2, Pose3
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages import sensor_data
from simscen.core.messages.navigation import Belief
from simscen.core.messages.sensor_data import Bump, Image, Imu, Odometry, Reading, Scan
from simscen.core.records.disturbances import BELIEF, COMMAND, FAULT_TARGET_KINDS, MAP, WHEELS
from simscen.faults.base import Fault, FaultEffect, FaultSetting
from simscen.sensors.sensor import Sensor, SensorSetting
from simscen.testing.contracts.base import Contract, call_component, promise, require
from simscen.testing.fakes import DIFFERENTIAL_DRIVE, FakeSensorView, SquareRoomRays

SENSOR_NAME = "tested_sensor"
"""Name of the tested sensor, and of the sensor of the readings that a fault receives."""
READINGS: dict[str, Callable[[int], Reading]] = {
    "Scan": lambda k: Scan(SENSOR_NAME, 24 * k, np.linspace(0.5, 5.0, 60) + 0.01 * k, -3.0, 0.1, 0.05, 8.0),
    "Odometry": lambda k: Odometry(SENSOR_NAME, 24 * k, Pose2(0.05 * k, 0.01 * k, 0.02 * k), Twist(0.5, 0.0, 0.2)),
    "Imu": lambda k: Imu(SENSOR_NAME, 24 * k, (0.0, 0.0, 0.2), (0.1, 0.0, 9.81)),
    "Bump": lambda k: Bump(SENSOR_NAME, 24 * k, k % 2 == 0),
    "Image": lambda k: Image(
        SENSOR_NAME, 24 * k, np.full((4, 6, 3), k % 200, np.uint8), np.full((4, 6), 2.0, np.float32)
    ),
}
"""Functions that return the k-th reading of each type. There is a reading every 24 ticks."""
FAULT_READING_COUNT = 40
"""Number of readings that a fault receives."""
GRID = OccupancyGrid(np.where(np.eye(20, dtype=bool), OCCUPIED, FREE).astype(np.int8), 0.25)


class FakeSensorSimulator:
    """Fake of faults.base.SensorSimulator, with which a fault simulates a displaced sensor or ignores objects."""

    def distances(self, scan: Scan, error: Pose3 | None = None, without: Collection[str] = ()) -> Array:
        """Return ranges of 2 m; with a displaced mount or without some objects, of 4 m."""
        return np.full(len(scan.ranges), 2.0 if error is None and not without else 4.0)

    def image(self, error: Pose3) -> Image:
        """Return a gray image."""
        return Image(SENSOR_NAME, 0, np.full((4, 6, 3), 90, np.uint8), np.full((4, 6), 3.0, np.float32))


class FaultContract(Contract):
    """Contract of a fault, on FAULT_READING_COUNT readings, commands, beliefs, or maps of each affected kind."""

    role = "fault"

    def start(self, kind: str, now: Callable[[], int] = lambda: 0) -> FaultEffect:
        """Start the fault on a kind of target, such as "Scan". `now` returns the current tick."""
        fault: Fault = self.spec
        setting = FaultSetting(
            0.3, now=now, kind=kind, simulator=FakeSensorSimulator() if kind in ("Scan", "Image") else None
        )
        return call_component("begins", fault.begin, np.random.default_rng(5), setting)

    def outputs(self, kind: str) -> list[Any]:
        """Return all outputs of the fault for inputs of a kind, such as "Scan", including delayed outputs."""
        tick = 0
        outputs: list[Any] = []
        effect = self.start(kind, lambda: tick)
        for k in range(FAULT_READING_COUNT):
            tick = 24 * k
            if kind in (COMMAND, WHEELS):
                outputs.append(call_component("returns delayed commands", effect.arriving_command))
                outputs.append(call_component("receives a command", effect.command, Twist(0.4, 0.0, 0.1 * (k % 5))))
            elif kind == BELIEF:
                outputs.append(call_component("receives a belief", effect.belief, _belief(k)))
            elif kind == MAP:
                outputs.append(call_component("receives a map", effect.map, GRID))
            else:
                outputs += call_component("returns delayed readings", effect.arriving_readings)
                outputs.append(call_component(f"receives a {kind}", effect.reading, READINGS[kind](k)))
        return outputs

    @promise
    def it_affects_known_targets(self) -> None:
        """Given a fault then `affects` contains at least one target, and only known targets."""
        affects = self.spec.affects
        require(affects, "affects nothing")
        unknown = sorted(set(affects) - set(FAULT_TARGET_KINDS))
        require(not unknown, f"affects {unknown}, which are not targets of faults")

    @promise
    def it_returns_the_same_type_or_none(self) -> None:
        """Given a reading or a command then the output has the same type, or is None.

        Given a belief or a map then the output has the same type.
        """
        for kind in sorted(self.spec.affects):
            for output in self.outputs(kind):
                if kind in (COMMAND, WHEELS):
                    is_valid = output is None or (isinstance(output, Twist) and bool(np.isfinite(output).all()))
                elif kind == BELIEF:
                    is_valid = isinstance(output, Belief) and bool(np.isfinite(output.pose).all())
                elif kind == MAP:
                    is_valid = isinstance(output, OccupancyGrid)
                else:
                    reading = READINGS[kind](0)
                    is_valid = output is None or (type(output) is type(reading) and output.sensor == reading.sensor)
                require(is_valid, f"returns {output!r} for a {kind}")

    @promise
    def the_same_generator_gives_the_same_answers_bit_for_bit(self) -> None:
        """Given the same inputs and random generator then the outputs are bit-identical."""
        for kind in sorted(self.spec.affects):
            one, other = (self.outputs(kind) for _ in range(2))
            is_same = len(one) == len(other) and all(map(are_identical, one, other))
            require(is_same, f"returns different outputs for the same {kind} and generator")

    @promise
    def a_reading_is_never_changed(self) -> None:
        """Given a reading then the fault does not change it, because the log contains it."""
        for kind in sorted(set(self.spec.affects) & set(READINGS)):
            effect = self.start(kind)
            for k in range(FAULT_READING_COUNT):
                reading = READINGS[kind](k)
                before = copy.deepcopy(reading)
                call_component(f"receives a {kind}", effect.reading, reading)
                require(are_identical(reading, before), f"changes the {kind} that it receives")

    @promise
    def its_end_leaves_an_effect_or_nothing(self) -> None:
        """Given the end of a fault then `end` returns the remaining FaultEffect, or None."""
        for kind in sorted(self.spec.affects):
            remaining = call_component("ends", self.start(kind).end)
            require(remaining is None or isinstance(remaining, FaultEffect), f"leaves {remaining!r}")


def are_identical(one: Any, other: Any) -> bool:
    """Return whether two readings, commands, beliefs, or maps are bit-identical."""
    if one is None or isinstance(one, tuple):
        return bool(one == other)
    return type(one) is type(other) and all(
        np.array_equal(a, b, equal_nan=a.dtype.kind == "f") if isinstance(a, np.ndarray) else a == b
        for a, b in ((getattr(one, f.name), getattr(other, f.name)) for f in fields(one))
    )


def _belief(number: int) -> Belief:
    pose, odometry = Pose2(1.0 + 0.05 * number, 2.0, 0.02 * number), Pose2(0.05 * number, 0.0, 0.02 * number)
    return Belief(pose, 0.01 * np.eye(3), pose.compose(odometry.inverse()), updated=24 * number)


READING_COUNT = 20
FIELDS_WITH_NAN = ("ranges", "depth")
"""Fields of readings that can be infinite or nan, for beams and pixels without a return."""


class SensorContract(Contract):
    """Contract of a sensor on a robot that drives a circle in a square room (see FakeSensorView)."""

    role = "sensor"

    def build(self) -> tuple[Sensor, FakeSensorView, int]:
        """Return a new sensor, its interface to the simulation, and its period in ticks."""
        clock, view = Clock(240), FakeSensorView()
        period, rng = clock.period(self.spec.rate), np.random.default_rng(1)
        setting = SensorSetting(
            SENSOR_NAME, period, clock.seconds(period), rng, view, SquareRoomRays(), DIFFERENTIAL_DRIVE
        )
        return call_component("is built", lambda: self.spec.implementation()(self.spec, setting)), view, period

    def measure(self, sensor: Sensor, view: FakeSensorView, period: int) -> list[Reading]:
        """Return READING_COUNT readings, one for each period. `view` and `period` are those of `build`."""
        readings = []
        for k in range(1, READING_COUNT + 1):
            view.seconds = k * period / 240
            readings.append(call_component("reads", sensor.read, k * period))
        return readings

    @promise
    def a_reading_has_the_declared_type_name_and_tick(self) -> None:
        """Given a tick then the reading has this tick, the type of the specification, and the name of the sensor."""
        sensor, view, period = self.build()
        require(sensor.name == SENSOR_NAME, f"is called {sensor.name!r}, not {SENSOR_NAME!r}")
        require(sensor.period == period, f"has a period of {sensor.period!r} ticks, not {period}")
        kind = getattr(sensor_data, self.spec.reading_type)
        for k, reading in enumerate(self.measure(sensor, view, period), start=1):
            require(type(reading) is kind, f"returns {type(reading).__name__}, not {self.spec.reading_type}")
            label = (reading.sensor, reading.tick)
            require(label == (SENSOR_NAME, k * period), f"labels a reading of tick {k * period} as {label}")

    @promise
    def the_numbers_of_a_reading_are_finite(self) -> None:
        """Given a reading then its numbers are finite, except ranges and depths."""
        for reading in self.measure(*self.build()):
            for field in fields(reading):
                value = getattr(reading, field.name)
                is_unset = value is None and field.default is None
                if is_unset or isinstance(value, str | bool) or field.name in FIELDS_WITH_NAN:
                    continue
                require(np.isfinite(np.asarray(value, dtype=np.float64)).all(), f"returns {field.name} = {value!r}")

    @promise
    def the_same_world_and_generator_give_the_same_readings_bit_for_bit(self) -> None:
        """Given the same world and random generator then the readings are bit-identical."""
        one, other = (self.measure(*self.build()) for _ in range(2))
        require(all(map(are_identical, one, other)), "returns different readings for the same world and generator")

    @promise
    def a_reading_does_not_change_after_it_was_given(self) -> None:
        """Given a returned reading then later calls of the sensor do not change this reading."""
        sensor, view, period = self.build()
        first = self.measure(sensor, view, period)
        original = copy.deepcopy(first)
        self.measure(sensor, view, period)
        require(all(map(are_identical, first, original)), "a reading changes when the next one is taken")
