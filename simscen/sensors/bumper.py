"""A bumper around the hull."""

from simscen.core.messages.sensor_data import Bump
from simscen.model.robot import Bumper
from simscen.sensors.sensor import SensorSetting


class BumperSensor:
    """Pressed while the hull touches something, and for a tenth of a second after."""

    def __init__(self, spec: Bumper, setting: SensorSetting) -> None:
        self.name, self.period, self._view = setting.name, setting.period, setting.view

    def read(self, tick: int) -> Bump:
        """Whether it is pressed now."""
        return Bump(self.name, tick, self._view.touching())
