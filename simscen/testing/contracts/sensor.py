"""The promises of a sensor."""

from __future__ import annotations

import copy
from dataclasses import dataclass, fields
from typing import Any

import numpy as np

from simscen.core.clock import Clock
from simscen.core.messages import sensor_data
from simscen.core.messages.sensor_data import Reading
from simscen.sensors.sensor import Sensor, SensorSetting
from simscen.testing.contracts.component import heard
from simscen.testing.contracts.fault import equal
from simscen.testing.promise import Contract, demand, promise
from simscen.testing.puppetview import DRIVE, PuppetView, SquareRoom

NAME = "it"
COUNT = 20
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

    def built(self, seed: int = 1) -> tuple[Sensor, PuppetView, int]:
        """A new one, what it looks at, and ticks between two readings."""
        clock, view = Clock(240), PuppetView()
        period, chance = clock.period(self.spec.rate), np.random.default_rng(seed)
        setting = SensorSetting(NAME, period, clock.seconds(period), chance, view, SquareRoom(), DRIVE)
        return heard("is built", lambda: self.spec.implementation()(self.spec, setting)), view, period

    def measured(self, sensor: Sensor, view: PuppetView, period: int) -> list[Reading]:
        """The next twenty readings."""
        taken = []
        for k in range(1, COUNT + 1):
            view.seconds = k * period / 240
            taken.append(heard("reads", sensor.read, k * period))
        return taken

    @promise
    def it_says_what_it_says_it_says(self) -> None:
        """Given a reading then it is of the kind of its specification, with the sensor's own name and the tick."""
        sensor, view, period = self.built()
        demand(sensor.name == NAME, f"is called {sensor.name!r}, not {NAME!r}")
        demand(sensor.period == period, f"has a period of {sensor.period!r} ticks, not {period}")
        kind = getattr(sensor_data, self.spec.says)
        for k, reading in enumerate(self.measured(sensor, view, period), start=1):
            demand(type(reading) is kind, f"says {type(reading).__name__}, not {self.spec.says}")
            signed = (reading.sensor, reading.tick)
            demand(signed == (NAME, k * period), f"signs a reading of tick {k * period} as {signed}")

    @promise
    def what_it_says_are_numbers(self) -> None:
        """Given a reading then its numbers are finite, but for ranges and depths that may be missing."""
        for reading in self.readings():
            for field in fields(reading):
                value = getattr(reading, field.name)
                if isinstance(value, str | bool) or field.name in MAY_BE_MISSING:
                    continue
                demand(np.isfinite(np.asarray(value, dtype=np.float64)).all(), f"says {field.name} of {value!r}")

    @promise
    def the_same_world_and_generator_give_the_same_readings_bit_for_bit(self) -> None:
        """Given the same world and generator then the same readings: no clock, no global chance."""
        one, other = self.readings(), self.readings()
        demand(all(map(equal, one, other)), "measures the same world in two ways")

    @promise
    def a_reading_does_not_change_after_it_was_given(self) -> None:
        """Given a reading then nothing that is measured later changes it."""
        sensor, view, period = self.built()
        first = self.measured(sensor, view, period)
        kept = copy.deepcopy(first)
        self.measured(sensor, view, period)
        demand(all(map(equal, first, kept)), "a reading changes when the next one is taken")
