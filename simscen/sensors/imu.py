"""Inertial measurement unit at the origin of the base frame."""

import math

from simscen.core.geometry import rotated
from simscen.core.messages.sensor_data import Imu
from simscen.model.robot import InertialUnit
from simscen.sensors.normal_stream import NormalStream
from simscen.sensors.sensor import SensorSetting, Vector

GRAVITY = 9.81  # m/s²
MAX_UNEXPLAINED_STEP_M = 0.05
"""A robot that moved this much farther than its velocity explains was placed elsewhere (`kidnap`)."""


class ImuSensor:
    """Measures the angular velocity with a constant bias, and the mean specific force since the last reading.

    When an action places the robot elsewhere, this is no acceleration: that reading contains gravity only.
    """

    def __init__(self, spec: InertialUnit, setting: SensorSetting) -> None:
        self.name, self.period = setting.name, setting.period
        self._gyro_std, self._force_std = spec.gyro_noise, spec.accelerometer_noise
        self._seconds, self._view = setting.seconds, setting.view
        self._bias: list[float] = setting.chance.normal(0.0, spec.gyro_bias, 3).tolist()
        self._normals = NormalStream(setting.chance)
        self._velocity, _ = self._view.base_velocity()
        self._position = self._view.base_pose()[:3]

    def read(self, tick: int) -> Imu:
        """Return a reading in the base frame. A level robot at rest measures +9.81 m/s² along z."""
        px, py, pz, i, j, k, w = self._view.base_pose()
        (ax, ay, az), (linear, angular) = self._velocity, self._view.base_velocity()
        if self._was_placed((px, py, pz), linear):
            ax, ay, az = linear
        self._velocity = vx, vy, vz = linear
        self._position = px, py, pz
        seconds, base_from_world = self._seconds, (-i, -j, -k, w)
        p, q, r = rotated(base_from_world, angular)
        x, y, z = rotated(base_from_world, ((vx - ax) / seconds, (vy - ay) / seconds, (vz - az) / seconds + GRAVITY))
        gyro, force, (bp, bq, br) = self._gyro_std, self._force_std, self._bias
        np, nq, nr, nx, ny, nz = self._normals.take(6)
        return Imu(
            self.name,
            tick,
            (p + bp + gyro * np, q + bq + gyro * nq, r + br + gyro * nr),
            (x + force * nx, y + force * ny, z + force * nz),
        )

    def _was_placed(self, position: Vector, velocity: Vector) -> bool:
        """Return whether the robot is farther from its last position than its velocities explain."""
        speed = max(math.hypot(*self._velocity), math.hypot(*velocity))
        return math.dist(position, self._position) > speed * self._seconds + MAX_UNEXPLAINED_STEP_M
