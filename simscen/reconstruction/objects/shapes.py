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
"""Maximum of half the angle that an object covers, so that the radius computed from this angle is finite."""
MIN_SIDE_M = 0.1
"""Minimum side of a box."""
SIZE_PERCENTILE = 90.0
"""Percentile of the visible sizes in single scans that is used as the size of a moving box."""
HEADING_SPEED_M_S, HEADING_SPAN_S = 0.25, 0.8
"""Speed above which the direction of motion is the heading, and time on each side over which the motion is measured."""
MIN_STAND_S = 1.5
"""Minimum duration of a stop, in which the speed is at most HEADING_SPEED_M_S."""
MAX_POINTS = 4000
"""Maximum number of hits that are used for the box of a standing object."""
SMOOTHING_SCANS = 5
"""Number of scans over which positions are smoothed."""
TRIED_ANGLES_RAD = np.radians(np.arange(0.0, 90.0, 2.0))
"""Orientations to try for the rectangle around a standing object."""


@dataclass(frozen=True, eq=False)
class ObjectShape:
    """Size and poses of an object.

    Attributes:
        size: (length, width) of a box in m, or (radius,) of a cylinder.
        times: Times (n,) of the poses in s.
        poses: Poses x, y, yaw (n, 3) of the center in the map frame.
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
    """Return the radius and the mean error in m of the cylinder that fits the fully visible clusters.

    Both are inf if fewer than three clusters are fully visible.
    """
    visible = [cluster for cluster in clusters if cluster.is_fully_visible and len(cluster.points) >= 5]
    if len(visible) < 3:
        return math.inf, math.inf
    radius = float(np.median([_circle_radius(cluster) for cluster in visible]))
    errors = [
        float(np.mean(np.abs(np.hypot(*(cluster.points - _circle_center(cluster, radius)).T) - radius)))
        for cluster in visible
    ]
    return radius, float(np.median(errors))


def _circle_radius(cluster: ScanCluster) -> float:
    """Return the radius in m of the circle with the same nearest range and the same angle, seen from the lidar."""
    nearest_range = float(np.hypot(*(cluster.points - cluster.lidar).T).min())
    sine = math.sin(min(cluster.angle / 2, MAX_HALF_ANGLE_RAD))
    return nearest_range * sine / (1.0 - sine)


def _circle_center(cluster: ScanCluster, radius: float) -> Array:
    """Return the center (2,) of the circle with this radius that fits the hits, in the mean direction of the hits."""
    offsets = cluster.points - cluster.lidar
    distances = np.hypot(*offsets.T)
    direction = (offsets / distances[:, None]).mean(axis=0)
    direction /= max(float(np.hypot(*direction)), 1e-9)
    # Each hit gives a distance of the center along the mean direction. The median is robust against outliers.
    across = offsets @ np.array([-direction[1], direction[0]])
    center_distances = offsets @ direction + np.sqrt(np.maximum(radius**2 - across**2, 0.0))
    center: Array = cluster.lidar + direction * float(np.median(center_distances))
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
    if len(points) > MAX_POINTS:
        points = points[:: len(points) // MAX_POINTS + 1]
    yaw = _orientation(points)
    rotation = np.array([[math.cos(yaw), -math.sin(yaw)], [math.sin(yaw), math.cos(yaw)]])
    local = points @ rotation
    low, high = np.percentile(local, 1, axis=0), np.percentile(local, 99, axis=0)
    size = np.maximum(high - low, MIN_SIDE_M)
    center = (low + high) / 2
    for axis in (0, 1):
        if high[axis] - low[axis] < MIN_SIDE_M:  # the lidar saw only one face, and the object is behind this face
            lidar = float(np.mean([cluster.lidar @ rotation[:, axis] for cluster in clusters]))
            center[axis] += math.copysign((size[axis] - (high[axis] - low[axis])) / 2, center[axis] - lidar)
    x, y = (rotation @ center).tolist()
    return ObjectShape(
        (round(float(size[0]), 2), round(float(size[1]), 2)), times, np.tile([x, y, yaw], (len(times), 1))
    )


def _orientation(points: Array) -> float:
    """Return the orientation in rad, from 0 to π/2, of the rectangle whose sides are closest to the points (m, 2).

    Source: Zhang, Xu, Dong and Dolan, Efficient L-shape fitting for vehicle detection using laser scanners (2017).
    """
    best_closeness, best_angle = -math.inf, 0.0
    for angle in TRIED_ANGLES_RAD.tolist():
        along = points @ np.array([math.cos(angle), math.sin(angle)])
        across = points @ np.array([-math.sin(angle), math.cos(angle)])
        distances = [
            np.abs(np.minimum(axis - np.percentile(axis, 1), np.percentile(axis, 99) - axis))
            for axis in (along, across)
        ]
        closeness = float(np.sum(1.0 / np.maximum(np.minimum(*distances), 0.03)))
        if closeness > best_closeness + 1e-9:
            best_closeness, best_angle = closeness, angle
    return best_angle


def _headings(times: Array, centers: Array) -> tuple[Array, Mask]:
    """Return the heading (n,) in rad at each time, and a mask (n,) of the times at which the object moves.

    A standing object keeps its last heading. Before the first motion, the heading is that of the first motion.
    """
    before = np.maximum(np.searchsorted(times, times - HEADING_SPAN_S), 0)
    after = np.minimum(np.searchsorted(times, times + HEADING_SPAN_S), len(times) - 1)
    motions = centers[after] - centers[before]
    speeds = np.hypot(*motions.T) / np.maximum(times[after] - times[before], 1e-3)
    is_moving = speeds > HEADING_SPEED_M_S
    moving_indices = np.flatnonzero(is_moving)
    if not len(moving_indices):
        total_motion = centers[-1] - centers[0]
        return np.full(len(times), math.atan2(total_motion[1], total_motion[0])), is_moving
    last_moving = np.searchsorted(moving_indices, np.arange(len(times)), side="right") - 1
    last_motions = motions[moving_indices[np.maximum(last_moving, 0)]]
    return np.arctan2(last_motions[:, 1], last_motions[:, 0]), is_moving


def _extents(clusters: list[ScanCluster], yaw: Array) -> tuple[Array, Array]:
    """Return the lowest and the highest coordinates (n, 2) of the hits of each cluster, along and across `yaw` (n,)."""
    low, high = np.empty((len(clusters), 2)), np.empty((len(clusters), 2))
    for index, cluster in enumerate(clusters):
        c, s = math.cos(yaw[index]), math.sin(yaw[index])
        local = cluster.points @ np.array([[c, -s], [s, c]])
        low[index], high[index] = local.min(axis=0), local.max(axis=0)
    return low, high


def _box_centers(clusters: list[ScanCluster], yaw: Array, low: Array, high: Array, size: Array) -> Array:
    """Return the centers (n, 2) of boxes of this `size` (2,). The faces toward the lidar are at the hits.

    `low` and `high` (n, 2) are the extents of the hits along and across the headings `yaw` (n,).
    """
    c, s = np.cos(yaw), np.sin(yaw)
    positions = np.array([cluster.lidar for cluster in clusters])
    x, y = positions.T
    lidar = np.column_stack((c * x + s * y, c * y - s * x))
    center = (low + high) / 2
    center = np.where(lidar < low, low + size / 2, center)
    center = np.where(lidar > high, high - size / 2, center)
    return np.column_stack((c * center[:, 0] - s * center[:, 1], s * center[:, 0] + c * center[:, 1]))


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
