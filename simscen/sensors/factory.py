"""Builds the sensors of a robot, and checks the readings of sensors from plugins."""

import traceback
from collections.abc import Callable
from dataclasses import fields
from typing import Any, NoReturn, TypeVar

import numpy as np

from simscen.core.clock import Clock
from simscen.core.errors import BROKEN_COMPONENT, RunError
from simscen.core.geometry.kinematics import Twist
from simscen.core.geometry.ray_fans import RayCaster
from simscen.core.messages import sensor_data
from simscen.core.messages.sensor_data import Reading
from simscen.core.random_streams import Streams
from simscen.model.robot import RobotSpec, SensorSpec
from simscen.sensors.sensor import Sensor, SensorSetting, SensorView


def build_sensors(
    spec: RobotSpec, clock: Clock, streams: Streams, view: SensorView, rays: RayCaster
) -> tuple[Sensor, ...]:
    """The robot's sensors in the order of their names, each with its own stream `sensor.<name>`.

    Those of installed packages come last: the log calls the first of a kind by the plain name. Raises ValueError when a
    rate does not divide the clock, RunError where what a package installed is no sensor.
    """
    return tuple(
        _build(name, spec, clock, streams, view, rays)
        for name in sorted(spec.sensors, key=lambda name: (spec.sensors[name].narrow is not None, name))
    )


def _build(name: str, robot: RobotSpec, clock: Clock, streams: Streams, view: SensorView, rays: RayCaster) -> Sensor:
    entry = robot.sensors[name]
    spec = entry.chosen
    assert isinstance(spec, SensorSpec)
    period, chance = clock.period(spec.rate), streams.generator(f"sensor.{name}")
    setting = SensorSetting(name, period, clock.seconds(period), chance, view, rays, robot.drive)
    if entry.narrow is not None:
        return PluginSensor(entry.kind, spec, setting)
    sensor: Sensor = spec.implementation()(spec, setting)
    return sensor


T = TypeVar("T")
_MAY_BE_MISSING = frozenset({"ranges", "depth"})
"""Arrays in which nan (no answer) and inf (nothing there) are answers."""


class PluginSensor:
    """Asks the sensor, and looks at its readings before the stack and the log get them."""

    def __init__(self, kind: str, spec: SensorSpec, setting: SensorSetting) -> None:
        self.name, self.period = setting.name, setting.period
        self._kind, self._spec = kind, spec
        self._reading: type = getattr(sensor_data, spec.says)
        self._inner: Any = self._ask(lambda: spec.implementation()(spec, setting))
        if not callable(getattr(self._inner, "read", None)):
            self._broke(f"{type(self._inner).__name__} has no `read`, which every sensor has")

    def read(self, tick: int) -> Reading:
        """Its reading. Raises RunError where that is none."""
        reading: Reading = self._ask(lambda: self._inner.read(tick))
        if type(reading) is not self._reading:
            self._broke(f"says {type(reading).__name__}, but its specification says {self._spec.says}")
        if (reading.sensor, reading.tick) != (self.name, tick):
            self._broke(f"signs its reading `{reading.sensor}` of tick {reading.tick}, at tick {tick}")
        for field in fields(reading):
            if why := _flaw(field.name, getattr(reading, field.name)):
                self._broke(f"says {field.name} that {why}")
        return reading

    def _ask(self, call: Callable[[], T]) -> T:
        try:
            return call()
        except (RunError, MemoryError):
            raise
        except Exception as error:  # the boundary to code of others, which can raise anything
            frame, line = list(traceback.walk_tb(error.__traceback__))[-1]
            place = f"{frame.f_code.co_filename.rpartition('/')[2]}:{line}"
            raise RunError("crashed", f"{self._who}: {type(error).__name__}: {error} ({place})") from error

    def _broke(self, what: str) -> NoReturn:
        raise RunError(BROKEN_COMPONENT, f"{self._who} {what}")

    @property
    def _who(self) -> str:
        return f"sensor `{self.name}` ({self._kind}, {self._spec.component})"


def _flaw(name: str, value: object) -> str:
    """What is wrong with one part of a reading; "" for nothing."""
    match value:
        case np.ndarray() if name in _MAY_BE_MISSING:
            wrong = value.dtype.kind != "f" or np.isneginf(value).any() or (value < 0).any() or not value.size
            return "are no distances" if wrong else ""
        case np.ndarray():
            return "" if value.dtype == np.uint8 and value.ndim == 3 else "are no colors"
        case tuple() | Twist():
            return "" if np.isfinite(np.array(value, dtype=float)).all() else "is not finite"
        case float() | np.floating():
            return "" if np.isfinite(value) else "is not finite"
        case bool() | int() | str() | np.bool_():
            return ""
    return f"is {type(value).__name__}"
