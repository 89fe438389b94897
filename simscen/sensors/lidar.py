"""Planar lidar: casts one ray per beam, adds Gaussian noise, and rounds the ranges to the resolution of the lidar."""

import math

import numpy as np

from simscen.core.geometry import Array, Pose2, Pose3, rotate_vector
from simscen.core.geometry.ray_fans import Float32Array, RayFan
from simscen.core.messages.sensor_data import Scan
from simscen.model.sensors import Lidar
from simscen.sensors.sensor import SensorSetting

MAX_NOISE_STDS = 10.0
"""Largest expected noise in standard deviations, by which the rays are longer than the maximum range."""
NOISE_BUFFER_SCANS = 8
"""Number of scans whose noise is drawn at once, to save time."""


class LidarSensor:
    """Lidar that measures all `spec.beams` directions at the same instant, as in Gazebo.

    If the field of view is less than 360 degrees, there is a beam on each of its edges.
    """

    def __init__(self, spec: Lidar, setting: SensorSetting) -> None:
        self.name, self.period = setting.name, setting.period
        self._spec, self._rng, self._view, self._rays = spec, setting.rng, setting.view, setting.rays
        is_full_circle = spec.field_of_view >= 2 * math.pi - 1e-9
        self._increment = spec.field_of_view / max(1, spec.beams if is_full_circle else spec.beams - 1)
        self._first = -spec.field_of_view / 2 if spec.beams > 1 else 0.0
        self._mount = Pose2(spec.mount.x, spec.mount.y, spec.mount.yaw)
        self._tilted_mount = None if spec.mount.is_level else spec.mount.pose
        yaw = spec.mount.yaw if spec.mount.is_level else 0.0  # the ray fan of a tilted lidar is in the lidar frame
        self._fan = RayFan(self._first + yaw, self._increment, spec.beams)
        angles = self._first + yaw + self._increment * np.arange(spec.beams)
        self._directions = np.column_stack((np.cos(angles), np.sin(angles)))  # in the frame of the ray fan
        # Beyond this distance, a range exceeds the maximum in spite of noise and rounding.
        self._cast_range = spec.max_range + MAX_NOISE_STDS * spec.noise + spec.resolution
        self._origin = spec.mount.x, spec.mount.y, spec.mount.z
        self._noise_buffer, self._next = np.empty((0, spec.beams)), 0

    def read(self, tick: int) -> Scan:
        """Return a scan. A range is inf without a hit up to the maximum range, -inf below the minimum (REP 117)."""
        pose, spec = self._view.base_pose(), self._spec
        if self._tilted_mount is not None:
            lidar = pose.compose(self._tilted_mount)
            hits = np.asarray(self._rays.sweep(self._fan, lidar, self._cast_range), dtype=np.float64)
            to_floor = floor_distances(lidar.z, self._directions @ lidar.rotation()[2, :2])
            ranges = self._to_ranges(np.minimum(hits, to_floor))
            limits = self._first, self._increment, spec.min_range, spec.max_range
            return Scan(self.name, tick, ranges, *limits, self._mount, self._tilted_mount)
        px, py, pz, i, j, k, w = pose
        x, y, z = rotate_vector((i, j, k, w), self._origin)
        origin = Pose3(px + x, py + y, pz + z, i, j, k, w)
        distances: Array | Float32Array = self._rays.sweep(self._fan, origin, self._cast_range)
        slopes = 2 * (i * k - j * w), 2 * (j * k + i * w)  # z components of the x and y axes of the base
        if math.hypot(*slopes) * self._cast_range > origin.z:  # the base is tilted so much that beams can hit the floor
            distances = np.minimum(distances, floor_distances(origin.z, self._directions @ np.array(slopes)))
        ranges = self._to_ranges(distances)
        return Scan(self.name, tick, ranges, self._first, self._increment, spec.min_range, spec.max_range, self._mount)

    def _to_ranges(self, distances: Array | Float32Array) -> Array:
        """Return the ranges (beams,) of a scan: true distances in m with noise, rounding, and limits."""
        spec = self._spec
        ranges: Array = distances + self._draw_noise() if spec.noise > 0 else distances.astype(np.float64)
        ranges /= spec.resolution
        np.rint(ranges, ranges)
        ranges *= spec.resolution
        # Finding the extremes is cheaper than two masks, and usually no range is out of bounds.
        nearest, farthest = ranges.item(ranges.argmin()), ranges.item(ranges.argmax())
        if farthest > spec.max_range:
            ranges[ranges > spec.max_range] = np.inf
        if nearest < spec.min_range:
            ranges[ranges < spec.min_range] = -np.inf
        return ranges

    def _draw_noise(self) -> Array:
        """Return the noise (beams,) of the next scan in m."""
        if self._next == len(self._noise_buffer):
            shape = NOISE_BUFFER_SCANS, self._spec.beams
            self._noise_buffer, self._next = self._rng.normal(0.0, self._spec.noise, shape), 0
        self._next += 1
        noise: Array = self._noise_buffer[self._next - 1]
        return noise


def floor_distances(height: float, beam_z: Array) -> Array:
    """Return the distances (n,) in m to the floor (z = 0) along beams; inf for beams that miss the floor.

    The beams start at a height of `height` m. `beam_z` (n,) are the z components of their unit vectors.
    """
    down = beam_z < -1e-9
    return np.where(down, height / np.where(down, -beam_z, 1.0), np.inf)
