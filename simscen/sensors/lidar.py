"""A planar lidar: rays, gaussian noise, ranges in whole steps. No work per beam in Python."""

import math

import numpy as np

from simscen.core.geometry import Array, Pose2
from simscen.core.sensing import Scan
from simscen.model.robot import Lidar
from simscen.sensors.sensor import SensorSetting

CERTAIN = 10.0
"""Standard deviations that noise never exceeds."""


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
        angles = self._first + self._increment * np.arange(spec.beams, dtype=np.float64)
        self._directions = _directions(angles + spec.mount.yaw)
        self._reach = spec.max_range + CERTAIN * spec.noise
        self._lens = np.array([spec.mount.x, spec.mount.y, spec.mount.z])

    def read(self, tick: int) -> Scan:
        """One scan. inf: nothing within range; nan: something nearer than the lidar can measure."""
        pose = self._view.base_pose()
        base_from_world = pose.rotation().T
        directions = self._directions @ base_from_world
        lens = self._lens @ base_from_world + pose[:3]
        origins = np.ndarray(directions.shape, np.float64, lens, 0, (0, 8))  # one place for all rays
        ranges = self._measured(self._rays.cast(origins, directions, self._reach))
        spec = self._spec
        return Scan(self.name, tick, ranges, self._first, self._increment, spec.min_range, spec.max_range, self._mount)

    def _measured(self, distances: Array) -> Array:
        """What the electronics make of true distances."""
        spec = self._spec
        if spec.noise > 0:
            ranges = self._chance.normal(0.0, spec.noise, len(distances))
            ranges += distances
            ranges /= spec.resolution
        else:
            ranges = distances / spec.resolution
        np.rint(ranges, out=ranges)
        ranges *= spec.resolution
        ranges[ranges > spec.max_range] = np.inf
        ranges[ranges < spec.min_range] = np.nan
        return ranges


def _directions(angles: Array) -> Array:
    return np.column_stack((np.cos(angles), np.sin(angles), np.zeros(len(angles))))
