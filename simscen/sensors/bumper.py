"""A bumper around the hull."""

from simscen.core.sensing import Bump
from simscen.sensors.sensor import SensorView


class BumperSensor:
    """Pressed while the hull touches something, and for a tenth of a second after."""

    def __init__(self, name: str, period: int, view: SensorView) -> None:
        self.name, self.period, self._view = name, period, view

    def read(self, tick: int) -> Bump:
        """Whether it is pressed now."""
        return Bump(self.name, tick, self._view.touching())
