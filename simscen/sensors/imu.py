"""An inertial unit at the base frame's origin."""

from simscen.core.geometry import rotated
from simscen.core.sensing import Imu
from simscen.model.robot import InertialUnit
from simscen.sensors.normals import Normals
from simscen.sensors.sensor import SensorSetting

GRAVITY = 9.81


class ImuSensor:
    """Turn rates with a bias that stays for a run, and specific force: the mean since the last reading."""

    def __init__(self, spec: InertialUnit, setting: SensorSetting) -> None:
        self.name, self.period = setting.name, setting.period
        self._spec, self._seconds, self._view = spec, setting.seconds, setting.view
        self._bias: list[float] = setting.chance.normal(0.0, spec.gyro_bias, 3).tolist()
        self._normals = Normals(setting.chance)
        self._velocity, _ = self._view.base_velocity()

    def read(self, tick: int) -> Imu:
        """Measure in the base frame; at rest and level the accelerometer shows +9.81 m/s² along z."""
        pose, seconds = self._view.base_pose(), self._seconds
        before, (linear, angular) = self._velocity, self._view.base_velocity()
        self._velocity = linear
        ax, ay, az = linear[0] - before[0], linear[1] - before[1], linear[2] - before[2]
        base_from_world = (-pose.qx, -pose.qy, -pose.qz, pose.qw)
        p, q, r = rotated(base_from_world, angular)
        x, y, z = rotated(base_from_world, (ax / seconds, ay / seconds, az / seconds + GRAVITY))
        gyro, force, bias = self._spec.gyro_noise, self._spec.accelerometer_noise, self._bias
        np, nq, nr, nx, ny, nz = self._normals.take(6)
        return Imu(
            self.name,
            tick,
            (p + bias[0] + gyro * np, q + bias[1] + gyro * nq, r + bias[2] + gyro * nr),
            (x + force * nx, y + force * ny, z + force * nz),
        )
