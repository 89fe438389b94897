"""Camera and bumper sensors, both without noise."""

from simscen.core.messages.sensor_data import Bump, Image
from simscen.model.sensors import Bumper, Camera
from simscen.sensors.sensor import SensorSetting


class CameraSensor:
    """Pinhole camera with color and depth, without noise or distortion."""

    def __init__(self, spec: Camera, setting: SensorSetting) -> None:
        self.name, self.period, self._spec, self._view = setting.name, setting.period, spec, setting.view
        self._mount = spec.mount.pose

    def read(self, tick: int) -> Image:
        """Return an image of the current scene."""
        spec = self._spec
        rgb, depth = self._view.image(self._mount, spec.width, spec.height, spec.field_of_view, spec.max_range)
        return Image(self.name, tick, rgb, depth, self._mount, spec.field_of_view)


class BumperSensor:
    """Contact switch around the hull, which stays pressed for 0.1 s after a contact."""

    def __init__(self, spec: Bumper, setting: SensorSetting) -> None:
        self.name, self.period, self._view = setting.name, setting.period, setting.view

    def read(self, tick: int) -> Bump:
        """Return a reading that states whether the bumper is pressed."""
        return Bump(self.name, tick, self._view.touching())
