"""A color and depth camera; its pictures come from the engine's renderer."""

from simscen.core.messages.sensor_data import Image
from simscen.model.robot import Camera
from simscen.sensors.sensor import SensorSetting


class CameraSensor:
    """A pinhole without noise or distortion; costs milliseconds a picture, so robots have none unless asked."""

    def __init__(self, spec: Camera, setting: SensorSetting) -> None:
        self.name, self.period, self._spec, self._view = setting.name, setting.period, spec, setting.view
        self._mount = spec.mount.pose

    def read(self, tick: int) -> Image:
        """Take a picture."""
        spec = self._spec
        rgb, depth = self._view.image(self._mount, spec.width, spec.height, spec.field_of_view, spec.max_range)
        return Image(self.name, tick, rgb, depth, self._mount, spec.field_of_view)
