"""Inertial measurement unit (IMU): gyroscope and accelerometer with noise and bias."""

from simscen.core.environment.world_model import GRAVITY_M_S2
from simscen.core.geometry import Pose3, Vector, rotated
from simscen.core.messages.sensor_data import Imu
from simscen.model.sensors import InertialUnit
from simscen.sensors.sensor import NormalStream, SensorSetting


class ImuSensor:
    """Measures the angular velocity with a constant bias, and the mean specific force since the last reading.

    The specific force is the acceleration minus gravity. The IMU is at `spec.mount`, or at the origin of the base frame
    if there is no mount. Teleporting the robot (action `kidnap`) causes no acceleration.
    """

    def __init__(self, spec: InertialUnit, setting: SensorSetting) -> None:
        self.name, self.period = setting.name, setting.period
        self._gyro_std, self._force_std = spec.gyro_noise, spec.accelerometer_noise
        self._gyro_variance, self._force_variance = spec.gyro_noise**2, spec.accelerometer_noise**2
        self._seconds, self._view = setting.seconds, setting.view
        self._bias: list[float] = setting.rng.normal(0.0, spec.gyro_bias, 3).tolist()
        self._normals = NormalStream(setting.rng)
        self._mount = Pose3() if spec.mount is None else spec.mount.pose
        self._is_at_base = spec.mount is None
        self._velocity = self._view.base_velocity()[0] if self._is_at_base else self._sensor_motion()[1]
        self._placements = self._view.placements()

    def read(self, tick: int) -> Imu:
        """Return a reading in the frame of the sensor. A level sensor at rest measures +9.81 m/s² along z."""
        (i, j, k, w), linear, angular = self._sensor_motion()
        px, py, pz = self._velocity
        if (placements := self._view.placements()) != self._placements:
            self._placements, (px, py, pz) = placements, linear
        self._velocity = vx, vy, vz = linear
        seconds, sensor_from_world = self._seconds, (-i, -j, -k, w)
        p, q, r = rotated(sensor_from_world, angular)
        x, y, z = rotated(
            sensor_from_world, ((vx - px) / seconds, (vy - py) / seconds, (vz - pz) / seconds + GRAVITY_M_S2)
        )
        gyro, force, (bp, bq, br) = self._gyro_std, self._force_std, self._bias
        np, nq, nr, nx, ny, nz = self._normals.take(6)
        return Imu(
            self.name,
            tick,
            (p + bp + gyro * np, q + bq + gyro * nq, r + br + gyro * nr),
            (x + force * nx, y + force * ny, z + force * nz),
            self._gyro_variance,
            self._force_variance,
            self._mount,
        )

    def _sensor_motion(self) -> tuple[tuple[float, float, float, float], Vector, Vector]:
        """Return orientation (x, y, z, w), linear velocity (m/s), and angular velocity (rad/s) in the world frame."""
        pose, (linear, angular) = self._view.base_pose(), self._view.base_velocity()
        if self._is_at_base:
            return pose.quaternion, linear, angular
        x, y, z = rotated(pose.quaternion, self._mount.position)
        (vx, vy, vz), (wx, wy, wz) = linear, angular
        moved = vx + wy * z - wz * y, vy + wz * x - wx * z, vz + wx * y - wy * x
        return pose.compose(self._mount).quaternion, moved, angular
