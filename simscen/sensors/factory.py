"""Build the sensors of a robot, and check the readings of sensors from plug-ins."""

from collections.abc import Callable
from dataclasses import fields
from typing import Any, NoReturn, TypeVar

import numpy as np

from simscen.core.clock import Clock
from simscen.core.errors import BROKEN_COMPONENT, RunError, exception_place
from simscen.core.geometry.ray_fans import RayCaster
from simscen.core.messages import sensor_data
from simscen.core.messages.sensor_data import Reading
from simscen.core.random_streams import Streams
from simscen.model.robot import RobotSpec
from simscen.model.sensors import SensorSpec
from simscen.sensors.sensor import Sensor, SensorSetting, SensorView

T = TypeVar("T")
_DISTANCE_ARRAYS = {"ranges": 1, "depth": 2}
"""Fields of readings that contain distances, with their number of array dimensions."""


def build_sensors(
    spec: RobotSpec, clock: Clock, streams: Streams, view: SensorView, rays: RayCaster
) -> tuple[Sensor, ...]:
    """Return the sensors of a robot: first shipped sensors, then sensors from plug-ins, both sorted by name.

    Each sensor has its own random stream `sensor.<name>`. `view` provides the true state, `rays` the true distances.
    Raises ValueError if a period is not a whole number of ticks, and RunError if a plug-in's sensor is invalid.
    """
    sensors: list[Sensor] = []
    for name, entry in sorted(spec.sensors.items(), key=lambda item: (item[1].original_class is not None, item[0])):
        sensor_spec = entry.chosen
        assert isinstance(sensor_spec, SensorSpec)
        period, rng = clock.period(sensor_spec.rate), streams.generator(f"sensor.{name}")
        setting = SensorSetting(name, period, clock.seconds(period), rng, view, rays, spec.drive)
        if entry.original_class is None:
            sensors.append(sensor_spec.implementation()(sensor_spec, setting))
        else:
            sensors.append(PluginSensor(entry.kind, sensor_spec, setting))
    return tuple(sensors)


class PluginSensor:
    """Wrapper of a sensor from a plug-in (an installed package), which validates each reading.

    `kind` is the YAML key of the sensor type. Constructor and `read` raise RunError if the plug-in's sensor raises an
    exception, or has no method `read`.
    """

    def __init__(self, kind: str, spec: SensorSpec, setting: SensorSetting) -> None:
        self.name, self.period = setting.name, setting.period
        self._kind, self._spec = kind, spec
        self._reading_type: type = getattr(sensor_data, spec.reading_type)
        self._sensor: Any = self._call(lambda: spec.implementation()(spec, setting))
        if not callable(getattr(self._sensor, "read", None)):
            self._fail(f"{type(self._sensor).__name__} has no method `read`")

    def read(self, tick: int) -> Reading:
        """Return a reading. Raises RunError if the reading is invalid."""
        reading: Reading = self._call(lambda: self._sensor.read(tick))
        if type(reading) is not self._reading_type:
            self._fail(f"returned {type(reading).__name__}, but its specification declares {self._spec.reading_type}")
        if (reading.sensor, reading.tick) != (self.name, tick):
            self._fail(f"returned a reading of `{reading.sensor}` at tick {reading.tick}, but it is tick {tick}")
        for field in fields(reading):
            value = getattr(reading, field.name)
            if value is None and field.default is None:  # an optional field
                continue
            if defect := _field_defect(field.name, value):
                self._fail(f"returned a reading whose `{field.name}` {defect}")
        return reading

    def _call(self, function: Callable[[], T]) -> T:
        """Call a function of the plug-in, and convert its exceptions to RunError, except MemoryError."""
        try:
            return function()
        except (RunError, MemoryError):
            raise
        except Exception as error:  # a plug-in can raise anything
            place = exception_place(error, self._spec.component)
            raise RunError("crashed", f"{self._label}: {type(error).__name__}: {error} ({place})") from error

    def _fail(self, problem: str) -> NoReturn:
        """Raise RunError. `problem` continues a sentence that starts with the sensor."""
        raise RunError(BROKEN_COMPONENT, f"{self._label} {problem}")

    @property
    def _label(self) -> str:
        return f"sensor `{self.name}` ({self._kind}, {self._spec.component})"


def _field_defect(name: str, value: object) -> str:
    """Return the defect of a reading's field, such as "is not finite", or "" if the field is valid.

    Valid distances are numbers of at least 0, nan (invalid), inf (no hit), and -inf (too close, REP 117).
    """
    match value:
        case np.ndarray() if name in _DISTANCE_ARRAYS:
            has_shape = value.ndim == _DISTANCE_ARRAYS[name] and value.size > 0
            is_valid = has_shape and value.dtype.kind == "f" and not (np.isfinite(value) & (value < 0)).any()
            return "" if is_valid else "is not an array of distances"
        case np.ndarray():
            return "" if value.dtype == np.uint8 and value.ndim == 3 else "is not an array of colors"
        case tuple():
            is_valid = all(isinstance(number, int | float | np.number) and np.isfinite(number) for number in value)
            return "" if is_valid else "does not consist of finite numbers"
        case float() | int() | np.floating() if name == "angle_increment" and value == 0:
            return "is 0"
        case float() | np.floating():
            return "" if np.isfinite(value) else "is not finite"
        case bool() | int() | str() | np.bool_():
            return ""
    return f"is a {type(value).__name__}"
