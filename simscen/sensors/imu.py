"""An inertial unit at the base frame's origin."""

import numpy as np

from simscen.core.geometry import Array
from simscen.core.sensing import Imu
from simscen.model.robot import InertialUnit
from simscen.sensors.sensor import SensorSetting

GRAVITY = np.array([0.0, 0.0, 9.81])


class ImuSensor:
    """Turn rates with a bias that stays for a run, and specific force: the mean since the last reading."""

    def __init__(self, spec: InertialUnit, setting: SensorSetting) -> None:
        self.name, self.period = setting.name, setting.period
        self._spec, self._seconds, self._chance, self._view = spec, setting.seconds, setting.chance, setting.view
        self._bias = self._chance.normal(0.0, spec.gyro_bias, 3)
        self._velocity = np.array(self._view.base_velocity()[0])

    def read(self, tick: int) -> Imu:
        """Measure in the base frame; at rest and level the accelerometer shows +9.81 m/s² along z."""
        base_from_world = self._view.base_pose().rotation().T
        linear, angular = (np.array(part) for part in self._view.base_velocity())
        force = (linear - self._velocity) / self._seconds + GRAVITY
        self._velocity = linear
        noise = self._chance.standard_normal((2, 3))
        turning = base_from_world @ angular + self._bias + self._spec.gyro_noise * noise[0]
        pushing = base_from_world @ force + self._spec.accelerometer_noise * noise[1]
        return Imu(self.name, tick, _vector(turning), _vector(pushing))


def _vector(values: Array) -> tuple[float, float, float]:
    x, y, z = values.tolist()
    return x, y, z
