"""Estimates the shape, size, and poses of a tracked object from the parts that the lidar saw."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import median_filter, uniform_filter1d

from simscen.core.geometry import Array
from simscen.reconstruction.drive.recorded_drive import Mask
from simscen.reconstruction.objects.clusters import ScanCluster
from simscen.reconstruction.reasons import find_windows

MAX_ROUND_RADIUS_M, MAX_ROUND_ERROR_M = 0.6, 0.035
"""Maximum radius of a round object, and maximum mean distance of its hits from a circle."""
MAX_HALF_ANGLE_RAD = math.radians(80.0)
"""Upper limit of half the angle that an object covers, so that the radius computed from this angle is finite."""
MIN_SIDE_M = 0.1
"""Minimum side of a box."""
SIZE_PERCENTILE = 90.0
"""Percentile of the visible sizes in single scans that is used as the size of a moving box."""
HEADING_SPEED_M_S, HEADING_SPAN_S = 0.25, 0.8
"""Speed above which the direction of motion is the heading, and time before and after over which it is measured."""
MIN_STAND_S = 1.5
"""Minimum duration of a stop, in which the speed is below HEADING_SPEED_M_S."""
SMOOTHING_SCANS = 5
"""Number of scans over which positions are smoothed."""
TRIED_ANGLES_RAD = np.radians(np.arange(0.0, 90.0, 2.0))
"""Orientations to try for the rectangle around a standing object."""


@dataclass(frozen=True, eq=False)
class ObjectShape:
    """Size of an object, and its `poses` x, y, yaw (n, 3) in the map frame at `times` (n,) in s.

    `size` is (length, width) of a box in m, or (radius,) of a cylinder.
    """

    size: tuple[float, ...]
    times: Array
    poses: Array


def fit_shape(clusters: list[ScanCluster], is_moving: bool) -> ObjectShape:
    """Return the shape of an object with a pose for each cluster. All poses of a standing object are equal."""
    times = np.array([cluster.time for cluster in clusters])
    radius, error = _fit_cylinder(clusters)
    if radius <= MAX_ROUND_RADIUS_M and error <= MAX_ROUND_ERROR_M:
        centers = np.array([_circle_center(cluster, radius) for cluster in clusters])
        if not is_moving:
            centers = np.tile(np.median(centers, axis=0), (len(centers), 1))
        poses = np.column_stack((_smoothed(centers) if is_moving else centers, np.zeros(len(centers))))
        return ObjectShape((round(max(radius, 0.05), 2),), times, poses)
    return _moving_box(clusters, times) if is_moving else _standing_box(clusters, times)


def _fit_cylinder(clusters: list[ScanCluster]) -> tuple[float, float]:
    """Return radius and mean error in m of the cylinder that fits the fully visible clusters; inf for few clusters."""
    whole = [cluster for cluster in clusters if cluster.is_fully_visible and len(cluster.points) >= 5]
    if len(whole) < 3:
        return math.inf, math.inf
    radius = float(np.median([_radius_of(cluster) for cluster in whole]))
    errors = [
        float(np.mean(np.abs(np.hypot(*(cluster.points - _circle_center(cluster, radius)).T) - radius)))
        for cluster in whole
    ]
    return radius, float(np.median(errors))


def _radius_of(cluster: ScanCluster) -> float:
    """Return the radius in m of the circle with the same nearest range and the same angle, seen from the lidar."""
    near = float(np.hypot(*(cluster.points - cluster.lidar).T).min())
    sine = math.sin(min(cluster.angle / 2, MAX_HALF_ANGLE_RAD))
    return near * sine / (1.0 - sine)


def _circle_center(cluster: ScanCluster, radius: float) -> Array:
    """Return the center (2,) of the circle with this radius that fits the hits, in the mean direction of the hits."""
    offsets = cluster.points - cluster.lidar
    distance = np.hypot(*offsets.T)
    middle = (offsets / distance[:, None]).mean(axis=0)
    middle /= max(float(np.hypot(*middle)), 1e-9)
    # Each hit gives a distance of the center along the mean direction. Their median is robust against outliers.
    across = offsets @ np.array([-middle[1], middle[0]])
    along = offsets @ middle + np.sqrt(np.maximum(radius**2 - across**2, 0.0))
    center: Array = cluster.lidar + middle * float(np.median(along))
    return center


def _moving_box(clusters: list[ScanCluster], times: Array) -> ObjectShape:
    """Return a box whose heading is the direction of motion. Headings, size, and centers are refined three times."""
    centers = np.array([cluster.center for cluster in clusters])
    yaw, size = np.zeros(len(times)), np.zeros(2)
    for _ in range(3):
        yaw, is_moving = _headings(times, _smoothed(centers))
        low, high = _extents(clusters, yaw)
        sizes = (high - low)[is_moving] if int(is_moving.sum()) >= SMOOTHING_SCANS else high - low
        size = np.maximum(np.percentile(sizes, SIZE_PERCENTILE, axis=0), MIN_SIDE_M)
        centers = _box_centers(clusters, yaw, low, high, size)
    poses = np.column_stack((_constant_at_rest(times, _smoothed(centers), is_moving), yaw))
    return ObjectShape((round(float(size[0]), 2), round(float(size[1]), 2)), times, poses)


def _constant_at_rest(times: Array, centers: Array, is_moving: Mask) -> Array:
    """Return `centers` (n, 2) with a constant center in each time window in which the object stands."""
    result: Array = centers.copy()
    for rest in find_windows(~is_moving, times, MIN_STAND_S):
        result[rest.samples] = np.median(centers[rest.samples], axis=0)
    return result


def _standing_box(clusters: list[ScanCluster], times: Array) -> ObjectShape:
    """Return the rectangle that fits the hits of all clusters together."""
    points = np.concatenate([cluster.points for cluster in clusters])
    if len(points) > 4000:
        points = points[:: len(points) // 4000 + 1]
    yaw = _orientation(points)
    turn = np.array([[math.cos(yaw), -math.sin(yaw)], [math.sin(yaw), math.cos(yaw)]])
    local = points @ turn
    low, high = np.percentile(local, 1, axis=0), np.percentile(local, 99, axis=0)
    size = np.maximum(high - low, MIN_SIDE_M)
    middle = (low + high) / 2
    for axis in (0, 1):
        if high[axis] - low[axis] < MIN_SIDE_M:  # only one face was seen: the object is behind it
            lidar = float(np.mean([cluster.lidar @ turn[:, axis] for cluster in clusters]))
            middle[axis] += math.copysign((size[axis] - (high[axis] - low[axis])) / 2, middle[axis] - lidar)
    x, y = (turn @ middle).tolist()
    return ObjectShape(
        (round(float(size[0]), 2), round(float(size[1]), 2)), times, np.tile([x, y, yaw], (len(times), 1))
    )


def _orientation(points: Array) -> float:
    """Return the orientation in rad, from 0 to π/2, of the rectangle whose sides are closest to the points (m, 2).

    Source: Zhang, Xu, Dong and Dolan, Efficient L-shape fitting for vehicle detection using laser scanners (2017).
    """
    best, found = -math.inf, 0.0
    for angle in TRIED_ANGLES_RAD.tolist():
        along = points @ np.array([math.cos(angle), math.sin(angle)])
        across = points @ np.array([-math.sin(angle), math.cos(angle)])
        edges = [np.minimum(side - np.percentile(side, 1), np.percentile(side, 99) - side) for side in (along, across)]
        closeness = float(np.sum(1.0 / np.maximum(np.minimum(np.abs(edges[0]), np.abs(edges[1])), 0.03)))
        if closeness > best + 1e-9:
            best, found = closeness, angle
    return found


def _headings(times: Array, centers: Array) -> tuple[Array, Mask]:
    """Return the heading (n,) in rad at each time, and a mask (n,) of the times at which the object moves.

    A standing object keeps its last heading. Before the first motion, it has the heading of the first motion.
    """
    before = np.maximum(np.searchsorted(times, times - HEADING_SPAN_S), 0)
    after = np.minimum(np.searchsorted(times, times + HEADING_SPAN_S), len(times) - 1)
    motion = centers[after] - centers[before]
    speed = np.hypot(*motion.T) / np.maximum(times[after] - times[before], 1e-3)
    is_moving = speed > HEADING_SPEED_M_S
    fast = np.flatnonzero(is_moving)
    if not len(fast):
        whole = centers[-1] - centers[0]
        return np.full(len(times), math.atan2(whole[1], whole[0])), is_moving
    newest = np.searchsorted(fast, np.arange(len(times)), side="right") - 1
    chosen = motion[fast[np.maximum(newest, 0)]]
    return np.arctan2(chosen[:, 1], chosen[:, 0]), is_moving


def _extents(clusters: list[ScanCluster], yaw: Array) -> tuple[Array, Array]:
    """Return the lowest and the highest coordinates (n, 2) of the hits of each cluster, along and across `yaw` (n,)."""
    low, high = np.empty((len(clusters), 2)), np.empty((len(clusters), 2))
    for index, cluster in enumerate(clusters):
        c, s = math.cos(yaw[index]), math.sin(yaw[index])
        local = cluster.points @ np.array([[c, -s], [s, c]])
        low[index], high[index] = local.min(axis=0), local.max(axis=0)
    return low, high


def _box_centers(clusters: list[ScanCluster], yaw: Array, low: Array, high: Array, size: Array) -> Array:
    """Return the centers (n, 2) of boxes with this `size` (2,) whose faces toward the lidar are at the hits.

    `low` and `high` (n, 2) are the extents of the hits along and across the headings `yaw` (n,).
    """
    c, s = np.cos(yaw), np.sin(yaw)
    at = np.array([cluster.lidar for cluster in clusters])
    lidar = np.column_stack((c * at[:, 0] + s * at[:, 1], c * at[:, 1] - s * at[:, 0]))
    middle = (low + high) / 2
    middle = np.where(lidar < low, low + size / 2, middle)
    middle = np.where(lidar > high, high - size / 2, middle)
    return np.column_stack((c * middle[:, 0] - s * middle[:, 1], s * middle[:, 0] + c * middle[:, 1]))


def _smoothed(centers: Array) -> Array:
    """Return `centers` (n, 2) after a median filter and a moving average over SMOOTHING_SCANS."""
    size = min(SMOOTHING_SCANS, len(centers))
    result: Array = np.column_stack(
        [
            uniform_filter1d(median_filter(centers[:, axis], size, mode="nearest"), size, mode="nearest")
            for axis in (0, 1)
        ]
    )
    return result
