"""Estimate of the robot's tilt from its IMU, and removal of the lidar hits on the floor that a tilted robot sees.

On the way down a ramp, the beams of a level lidar point to the floor ahead, whose hits look like a wall.
"""

import math
from dataclasses import replace

import numpy as np

from simscen.core.environment.world_model import GRAVITY_M_S2
from simscen.core.messages.sensor_data import Imu, Odometry, Scan

CORRECTION_TIME_S = 1.0
"""Time constant with which the measured acceleration corrects the direction that the gyroscope yields."""
MAX_GAP_S = 0.5
"""Maximum time between two readings that are compared."""
MAX_ACCELERATION_ERROR_M_S2 = 1.0
"""Maximum difference between the magnitudes of the measured acceleration and of gravity, for a correction."""
MIN_SLOPE = 0.05
"""Slope of a beam below which its hit counts as an obstacle, because the tilt is not known more precisely."""
MIN_LIDAR_HEIGHT_M = 0.1
"""Assumed height of the lidar above the floor. Hits of a lower lidar on the floor are not recognized."""


class TiltEstimator:
    """Complementary filter: the gyroscope turns the direction of gravity, and the accelerometer corrects it.

    The acceleration of the robot, by its odometry, is subtracted from the measured acceleration. Readings are in the
    base frame.
    """

    def __init__(self, tick_rate: int) -> None:
        self._tick_rate = tick_rate
        self.up = (0.0, 0.0, 1.0)
        """Estimated upward direction (against gravity) in the base frame, a unit vector."""
        self._imu: Imu | None = None
        self._odometry: Odometry | None = None
        self._acceleration = (0.0, 0.0)  # of the robot along x and y, by odometry

    def add_odometry(self, odometry: Odometry) -> None:
        """Update the acceleration of the robot from its changes of velocity and from its turn."""
        last, self._odometry = self._odometry, odometry
        vx, vy, wz = odometry.twist
        forward = left = 0.0
        if last is not None and (seconds := self._seconds(last.tick, odometry.tick)):
            forward, left = (vx - last.twist.vx) / seconds, (vy - last.twist.vy) / seconds
        self._acceleration = forward - vy * wz, left + vx * wz

    def add_imu(self, imu: Imu) -> None:
        """Update the direction with a reading in the base frame."""
        last, self._imu = self._imu, imu
        if last is None or not (seconds := self._seconds(last.tick, imu.tick)):
            return
        (x, y, z), (wx, wy, wz) = self.up, imu.angular_velocity
        x, y, z = x + (y * wz - z * wy) * seconds, y + (z * wx - x * wz) * seconds, z + (x * wy - y * wx) * seconds
        ax, ay, az = imu.linear_acceleration
        ax, ay = ax - self._acceleration[0], ay - self._acceleration[1]
        if abs(math.hypot(ax, ay, az) - GRAVITY_M_S2) < MAX_ACCELERATION_ERROR_M_S2:
            share = min(1.0, seconds / CORRECTION_TIME_S)
            pairs = ((x, ax), (y, ay), (z, az))
            x, y, z = (up + share * (acceleration / GRAVITY_M_S2 - up) for up, acceleration in pairs)
        length = math.hypot(x, y, z)
        if 0.0 < length < math.inf:
            self.up = x / length, y / length, z / length

    def _seconds(self, before: int, now: int) -> float:
        """Return the time between two ticks in s; 0 if this time is negative or longer than MAX_GAP_S."""
        seconds = (now - before) / self._tick_rate
        return seconds if 0.0 < seconds <= MAX_GAP_S else 0.0

    def without_floor(self, scan: Scan) -> Scan:
        """Return a scan in which possible hits on the floor are nan: hits far enough below the lidar.

        A scan of a tilted lidar is returned unchanged.
        """
        x, y, _ = self.up
        if math.hypot(x, y) < MIN_SLOPE or scan.tilted_mount is not None:
            return scan
        angles = scan.mount.yaw + scan.angles()
        descent = -(x * np.cos(angles) + y * np.sin(angles))
        is_floor = np.isfinite(scan.ranges) & (descent > MIN_SLOPE) & (scan.ranges * descent > MIN_LIDAR_HEIGHT_M)
        return replace(scan, ranges=np.where(is_floor, np.nan, scan.ranges)) if is_floor.any() else scan
