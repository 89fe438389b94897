"""Readings of tilted sensors, converted for consumers that work in the plane of the base."""

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np

from simscen.core.geometry import Array, Pose3, rotated
from simscen.core.messages.sensor_data import Imu, Scan

MIN_HEIGHT_M = 0.05
"""Hits below this height are the floor; a lidar that is mounted lower uses half its own height."""
MAX_HEIGHT_M = 2.0
"""Hits above this height are above the robot (`max_obstacle_height` of Nav2's costmap)."""
AT_BASE = Pose3()
"""Mount of a sensor in the base frame."""


def level_scan(scan: Scan) -> Scan:
    """Return the scan that a level lidar at the same place would report, as pointcloud_to_laserscan does.

    Each level beam reports the nearest range of the tilted beams in its direction. Hits count only between MIN_HEIGHT_M
    and MAX_HEIGHT_M; a tilted beam without a hit counts as inf. Without such a beam, the range is nan, because what is
    at these heights remains unknown. For a lidar that is mounted upside down this is exact. Other directions are
    rounded to the nearest beam.
    """
    if scan.tilted_mount is None:
        return scan
    count = len(scan.ranges)
    first, increment, beams, flat, slopes = _level_beams(
        scan.tilted_mount, scan.mount.yaw, scan.angle_min, scan.angle_increment, count
    )
    height = scan.tilted_mount.z
    with np.errstate(invalid="ignore"):
        heights = height + np.where(np.isfinite(scan.ranges), scan.ranges, 0.0) * slopes
        is_obstacle = (heights >= min(MIN_HEIGHT_M, height / 2)) & (heights <= MAX_HEIGHT_M)
        ranges = np.where(is_obstacle | np.isinf(scan.ranges), scan.ranges * flat, np.nan)
    level = np.full(count, np.nan)
    order = np.argsort(-ranges)  # so that the nearest of several hits remains
    order = order[~np.isnan(ranges[order])]
    level[beams[order]] = ranges[order]
    return replace(scan, ranges=level, angle_min=first, angle_increment=increment, tilted_mount=None)


def imu_in_base_frame(imu: Imu) -> Imu:
    """Return the reading rotated to the axes of the base.

    The acceleration remains that at the position of the sensor, including the centripetal acceleration there.
    """
    if imu.mount == AT_BASE:
        return imu
    quaternion = imu.mount.quaternion
    return replace(
        imu,
        angular_velocity=rotated(quaternion, imu.angular_velocity),
        linear_acceleration=rotated(quaternion, imu.linear_acceleration),
        mount=AT_BASE,
    )


@lru_cache(maxsize=16)
def _level_beams(
    mount: Pose3, yaw: float, first: float, increment: float, count: int
) -> tuple[float, float, Array, Array, Array]:
    """Return angle_min and angle_increment of the level scan, and for each tilted beam three arrays (count,).

    These are the index of the level beam, and the horizontal and the vertical part of its unit vector.
    """
    rotation = mount.rotation()
    angles = first + increment * np.arange(count, dtype=np.float64)
    x, y, z = rotation[:, :2] @ np.array((np.cos(angles), np.sin(angles)))
    last = first + increment * (count - 1)
    lowest = min(first, last) if rotation[2, 2] >= 0 else min(-first, -last)
    step = abs(increment) or 1.0
    offsets = np.remainder(np.arctan2(y, x) - yaw - lowest + step / 2, 2 * math.pi) - step / 2
    beams = np.rint(offsets / step).astype(np.int64)
    return lowest, step, np.clip(beams, 0, count - 1), np.hypot(x, y), z
