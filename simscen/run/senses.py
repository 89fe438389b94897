"""All sensors of the robot, each at its own rate."""

from collections.abc import Sequence

from simscen.core.sensing import Reading, Readings
from simscen.sensors.sensor import Sensor


class Senses:
    """Reads the sensors that are due at a tick, in the order of the robot's specification."""

    def __init__(self, sensors: Sequence[Sensor]) -> None:
        self._sensors = tuple(sensors)

    @property
    def periods(self) -> tuple[int, ...]:
        """The period of each sensor in ticks."""
        return tuple(sensor.period for sensor in self._sensors)

    def read(self, tick: int) -> Readings:
        """The new readings of this tick."""
        due: list[Reading] = [sensor.read(tick) for sensor in self._sensors if tick % sensor.period == 0]
        return tuple(due)
