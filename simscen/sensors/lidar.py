"""A planar lidar: rays, gaussian noise, ranges in whole steps. No work per beam in Python."""

import math

import numpy as np

from simscen.core.geometry import Array, Pose2, Pose3, rotated
from simscen.core.geometry.ray_fans import RayFan, Singles
from simscen.core.messages.sensor_data import Scan
from simscen.model.robot import Lidar
from simscen.sensors.sensor import SensorSetting

CERTAIN = 10.0
"""Standard deviations that noise never exceeds."""
AT_ONCE = 8
"""Scans whose noise is drawn at once."""


class LidarSensor:
    """Measures along `spec.beams` directions at once; a scan is an instant, as in Gazebo.

    A full circle has no beam twice; any other field of view has beams on both of its edges.
    """

    def __init__(self, spec: Lidar, setting: SensorSetting) -> None:
        self.name, self.period = setting.name, setting.period
        self._spec, self._chance, self._view, self._rays = spec, setting.chance, setting.view, setting.rays
        full = spec.field_of_view >= 2 * math.pi - 1e-9
        self._increment = spec.field_of_view / max(1, spec.beams if full else spec.beams - 1)
        self._first = -spec.field_of_view / 2 if spec.beams > 1 else 0.0
        self._mount = Pose2(spec.mount.x, spec.mount.y, spec.mount.yaw)
        self._fan = RayFan(self._first + spec.mount.yaw, self._increment, spec.beams)
        # What is beyond this is beyond the lidar's range whatever the noise, and when it is rounded to a whole step.
        self._reach = spec.max_range + CERTAIN * spec.noise + spec.resolution
        self._lens = spec.mount.x, spec.mount.y, spec.mount.z
        self._ahead, self._next = np.empty((0, spec.beams)), 0

    def read(self, tick: int) -> Scan:
        """One scan. inf: nothing within range; nan: something nearer than the lidar can measure."""
        pose = self._view.base_pose()
        px, py, pz, i, j, k, w = pose
        x, y, z = rotated((i, j, k, w), self._lens)
        ranges = self._measured(self._rays.sweep(self._fan, Pose3(px + x, py + y, pz + z, i, j, k, w), self._reach))
        spec = self._spec
        return Scan(self.name, tick, ranges, self._first, self._increment, spec.min_range, spec.max_range, self._mount)

    def _measured(self, distances: Array | Singles) -> Array:
        """What the electronics make of true distances."""
        spec = self._spec
        ranges: Array = distances + self._noise() if spec.noise > 0 else distances.astype(np.float64)
        ranges /= spec.resolution
        np.rint(ranges, ranges)
        ranges *= spec.resolution
        # Where the nearest and the farthest are is told sooner than which are too near or too far; mostly none is.
        near, far = ranges.item(ranges.argmin()), ranges.item(ranges.argmax())
        if far > spec.max_range:
            ranges[ranges > spec.max_range] = np.inf
        if near < spec.min_range:
            ranges[ranges < spec.min_range] = np.nan
        return ranges

    def _noise(self) -> Array:
        """That of a scan, in meters; drawn ahead for several, as single draws would give it."""
        if self._next == len(self._ahead):
            self._ahead, self._next = self._chance.normal(0.0, self._spec.noise, (AT_ONCE, self._spec.beams)), 0
        self._next += 1
        noise: Array = self._ahead[self._next - 1]
        return noise
