"""Inertial measurement unit (IMU): gyroscope and accelerometer with noise and bias."""

from simscen.core.environment.world_model import GRAVITY_M_S2
from simscen.core.geometry import Pose3, Vector, rotate_vector
from simscen.core.messages.sensor_data import Imu
from simscen.model.sensors import InertialUnit
from simscen.sensors.sensor import NormalStream, SensorSetting


class ImuSensor:
    """Measures the angular velocity with a constant bias, and the mean specific force since the last reading.

    The specific force is the acceleration minus gravity. The IMU is at `spec.mount`; without a mount, at the origin of
    the base frame. Teleporting the robot (action `kidnap`) causes no acceleration.
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
        old_vx, old_vy, old_vz = self._velocity
        if (placements := self._view.placements()) != self._placements:  # teleported: no acceleration
            self._placements, (old_vx, old_vy, old_vz) = placements, linear
        self._velocity = vx, vy, vz = linear
        seconds, sensor_from_world = self._seconds, (-i, -j, -k, w)
        wx, wy, wz = rotate_vector(sensor_from_world, angular)
        ax, ay, az = rotate_vector(
            sensor_from_world,
            ((vx - old_vx) / seconds, (vy - old_vy) / seconds, (vz - old_vz) / seconds + GRAVITY_M_S2),
        )
        gyro_std, force_std, (bias_x, bias_y, bias_z) = self._gyro_std, self._force_std, self._bias
        gyro_x, gyro_y, gyro_z, force_x, force_y, force_z = self._normals.take(6)
        return Imu(
            self.name,
            tick,
            (wx + bias_x + gyro_std * gyro_x, wy + bias_y + gyro_std * gyro_y, wz + bias_z + gyro_std * gyro_z),
            (ax + force_std * force_x, ay + force_std * force_y, az + force_std * force_z),
            self._gyro_variance,
            self._force_variance,
            self._mount,
        )

    def _sensor_motion(self) -> tuple[tuple[float, float, float, float], Vector, Vector]:
        """Return the sensor's orientation (x, y, z, w), linear velocity (m/s), and angular velocity (rad/s).

        All three are in the world frame.
        """
        pose, (linear, angular) = self._view.base_pose(), self._view.base_velocity()
        if self._is_at_base:
            return pose.quaternion, linear, angular
        x, y, z = rotate_vector(pose.quaternion, self._mount.position)
        (vx, vy, vz), (wx, wy, wz) = linear, angular
        velocity_at_mount = vx + wy * z - wz * y, vy + wz * x - wx * z, vz + wx * y - wy * x
        return pose.compose(self._mount).quaternion, velocity_at_mount, angular
