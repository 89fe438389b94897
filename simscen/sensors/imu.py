"""An inertial unit at the base frame's origin."""

from simscen.core.geometry import rotated
from simscen.core.messages.sensor_data import Imu
from simscen.model.robot import InertialUnit
from simscen.sensors.normals import Normals
from simscen.sensors.sensor import SensorSetting

GRAVITY = 9.81


class ImuSensor:
    """Turn rates with a bias that stays for a run, and specific force: the mean since the last reading."""

    def __init__(self, spec: InertialUnit, setting: SensorSetting) -> None:
        self.name, self.period = setting.name, setting.period
        self._gyro, self._force = spec.gyro_noise, spec.accelerometer_noise
        self._seconds, self._view = setting.seconds, setting.view
        self._bias: list[float] = setting.chance.normal(0.0, spec.gyro_bias, 3).tolist()
        self._normals = Normals(setting.chance)
        self._velocity, _ = self._view.base_velocity()

    def read(self, tick: int) -> Imu:
        """Measure in the base frame; at rest and level the accelerometer shows +9.81 m/s² along z."""
        _, _, _, i, j, k, w = self._view.base_pose()
        (ax, ay, az), (linear, angular) = self._velocity, self._view.base_velocity()
        self._velocity = vx, vy, vz = linear
        seconds, base_from_world = self._seconds, (-i, -j, -k, w)
        p, q, r = rotated(base_from_world, angular)
        x, y, z = rotated(base_from_world, ((vx - ax) / seconds, (vy - ay) / seconds, (vz - az) / seconds + GRAVITY))
        gyro, force, (bp, bq, br) = self._gyro, self._force, self._bias
        np, nq, nr, nx, ny, nz = self._normals.take(6)
        return Imu(
            self.name,
            tick,
            (p + bp + gyro * np, q + bq + gyro * nq, r + br + gyro * nr),
            (x + force * nx, y + force * ny, z + force * nz),
        )
