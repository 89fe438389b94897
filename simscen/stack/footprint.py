"""Collision checks of the robot's footprint with costmap cells and moving obstacles, for planners and controllers."""

import math

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array
from simscen.core.geometry.polygons import points_in_polygon
from simscen.stack.moving_obstacles import Mask, MovingObstacles, Reals
from simscen.stack.protocols import CostmapView, RobotModel


def distances(costmap: CostmapView, points: Reals) -> npt.NDArray[np.float32]:
    """Return the distances (…,) in m from points (…, 2) to the nearest lethal cell; 0 outside the costmap."""
    height, width = costmap.distance.shape
    across = (points[..., 0] - costmap.origin[0]) * (1.0 / costmap.resolution)
    up = (points[..., 1] - costmap.origin[1]) * (1.0 / costmap.resolution)
    inside = (up >= 0) & (across >= 0) & (up < height) & (across < width)
    if inside.all():
        return costmap.distance[up.astype(np.int32), across.astype(np.int32)]
    rows, columns = np.where(inside, up, 0.0).astype(np.int32), np.where(inside, across, 0.0).astype(np.int32)
    return np.where(inside, costmap.distance[rows, columns], np.float32(0.0))


def distance_at(costmap: CostmapView, x: float, y: float) -> float:
    """Return the distance in m from one point to the nearest lethal cell; 0 outside the costmap."""
    left, low = costmap.origin
    distance, resolution = costmap.distance, costmap.resolution
    row, column = math.floor((y - low) / resolution), math.floor((x - left) / resolution)
    height, width = distance.shape
    return distance.item(row, column) if 0 <= row < height and 0 <= column < width else 0.0


def lethal_cells_near(costmap: CostmapView, x: float, y: float, half_side: float) -> Array:
    """Return the centers (n, 2) of the lethal cells in a square around (x, y), whose side is 2 * `half_side` m."""
    left, low = costmap.origin
    axes = (y, low), (x, left)  # center of the square, and edge of the costmap
    first = [max(0, math.floor((center - half_side - edge) / costmap.resolution)) for center, edge in axes]
    last = [max(0, math.ceil((center + half_side - edge) / costmap.resolution)) for center, edge in axes]
    cells = np.argwhere(costmap.distance[first[0] : last[0], first[1] : last[1]] <= 0.0) + np.array(first)
    centers: Array = np.array((left, low)) + (cells[:, ::-1] + 0.5) * costmap.resolution
    return centers


class Footprint:
    """Collision checker for many poses at once. A footprint is in collision if it contains a lethal cell.

    inscribed, circumscribed:  radii of the footprint in m
    rotation_radius:           maximum distance in m by which a point of the footprint moves per rad of rotation; 0 for
                               a round footprint
    discs:                     discs that cover the footprint, for faster checks
    """

    def __init__(self, robot: RobotModel, resolution: float) -> None:
        """Prepare checks of a robot on costmaps with cells of `resolution` m."""
        self.inscribed = robot.inscribed_radius
        self._is_round = robot.radius is not None
        self.rotation_radius = 0.0 if self._is_round else robot.circumscribed_radius
        self.circumscribed = robot.circumscribed_radius
        corners = np.array(robot.footprint, dtype=np.float64)
        inner = _inner_points(corners, resolution, self.inscribed)
        self._points = np.concatenate((_edge_points(corners, resolution), inner))
        """Points (k, 2) in the base frame that are checked for lethal cells."""
        self._depth = _edge_distances(corners, self._points).astype(np.float32)
        """Distances (k,) in m of these points from the edge of the footprint."""
        self._corners, self.discs = corners, CoveringDiscs(robot)

    def point_distances(self, points: Array, poses: Array) -> Array:
        """Return distances (n, k) in m from the footprint's edge at poses (n, 3) to points (k, 2); negative inside."""
        cosine, sine = np.cos(poses[:, 2, None]), np.sin(poses[:, 2, None])
        x, y = points[None, :, 0] - poses[:, 0, None], points[None, :, 1] - poses[:, 1, None]
        if self._is_round:
            return np.asarray(np.hypot(x, y) - self.circumscribed)
        local = np.stack((cosine * x + sine * y, cosine * y - sine * x), axis=-1).reshape(-1, 2)
        signed = np.where(points_in_polygon(self._corners.tolist(), local), -1.0, 1.0) * _edge_distances(
            self._corners, local
        )
        return np.asarray(signed.reshape(x.shape))

    def free(self, costmap: CostmapView, poses: Array) -> Mask:
        """Return at which of the poses (n, 3) the footprint contains no lethal cell."""
        distance = distances(costmap, poses[:, :2])
        free: Mask = np.asarray(distance > np.float32(self.inscribed))
        if self._is_round:
            return free
        undecided = np.flatnonzero(free & (distance <= self.circumscribed + costmap.resolution))
        if len(undecided):
            free[undecided] = (distances(costmap, self._points_at(poses[undecided])) > 0.0).all(axis=1)
        return free

    def clearance(self, costmap: CostmapView, poses: Array) -> Array:
        """Return approximate distances (n,) in m from the footprint's edge at poses (n, 3) to the nearest lethal cell.

        In collision, the result is negative: minus the distance of the innermost lethal cell from the footprint's edge.
        """
        center = distances(costmap, poses[:, :2]).astype(np.float64) - self.inscribed
        if self._is_round:
            return np.asarray(center)
        near = distances(costmap, self._points_at(poses))
        edge = near.min(axis=1).astype(np.float64)
        in_collision = np.flatnonzero(edge <= 0.0)
        if len(in_collision):
            edge[in_collision] = (near[in_collision] - self._depth).min(axis=1)
        return np.asarray(np.minimum(edge, center))

    def gap(self, moving: MovingObstacles, poses: Array, times: Array, sigmas: float = 0.0) -> Array:
        """Return distances (…,) in m from the footprint at poses (…, 3) to the nearest moving obstacle.

        Distances are negative in collision. They are a few cm too small if the footprint is not round. The obstacles
        are at the positions predicted for `times` in s, which broadcast with the poses. The obstacles are inflated by
        `sigmas` standard deviations of their position.
        """
        x, y, yaw = poses[..., 0], poses[..., 1], poses[..., 2]
        return np.asarray(self.discs.gap(moving, x, y, yaw, times, sigmas), dtype=np.float64)

    def _points_at(self, poses: Array) -> Array:
        """Return the points (n, k, 2) of the footprint that are checked for lethal cells, at poses (n, 3)."""
        cosine, sine = np.cos(poses[:, 2, None]), np.sin(poses[:, 2, None])
        x = poses[:, 0, None] + cosine * self._points[:, 0] - sine * self._points[:, 1]
        y = poses[:, 1, None] + sine * self._points[:, 0] + cosine * self._points[:, 1]
        return np.stack((x, y), axis=-1)


class CoveringDiscs:
    """Row of k equal discs along the x axis of the base that cover the footprint, for fast approximate checks.

    offsets:      x coordinates (k,) of the centers in m in the base frame
    radius:       radius of each disc in m
    reach:        maximum distance in m from the base to a point of a disc
    is_centered:  whether there is only one disc, with its center at the base
    """

    def __init__(self, robot: RobotModel) -> None:
        if robot.radius is not None:
            self.offsets, self.radius, self.reach, self.is_centered = np.zeros(1), robot.radius, robot.radius, True
            return
        corners = np.array(robot.footprint, dtype=np.float64)
        (back, right), (front, left) = corners.min(axis=0), corners.max(axis=0)
        half_width = max(-right, left)
        count = max(1, round((front - back) / (2 * half_width) * 2))
        segment = (front - back) / count
        self.offsets = back + segment * (np.arange(count) + 0.5)
        self.radius = math.hypot(half_width, segment / 2)
        self.reach = float(np.abs(self.offsets).max()) + self.radius
        self.is_centered = self.offsets.tolist() == [0.0]

    def clearance(self, costmap: CostmapView, x: Reals, y: Reals, yaw: Reals) -> npt.NDArray[np.float32]:
        """Return distances (…,) in m from the discs at poses (…,) to the nearest lethal cell; negative in collision."""
        if self.is_centered:
            return np.asarray(distances(costmap, np.stack((x, y), axis=-1)) - np.float32(self.radius))
        cosine, sine = np.cos(yaw), np.sin(yaw)
        minimum: npt.NDArray[np.float32] | None = None
        for offset in self.offsets.tolist():
            distance = distances(costmap, np.stack((x + offset * cosine, y + offset * sine), axis=-1))
            minimum = distance if minimum is None else np.minimum(minimum, distance)
        assert minimum is not None
        return np.asarray(minimum - np.float32(self.radius))

    def gap(self, moving: MovingObstacles, x: Reals, y: Reals, yaw: Reals, times: Reals, sigmas: float = 0.0) -> Reals:
        """Return distances (…,) in m from the discs at poses (…,) to the nearest moving obstacle at `times` (s).

        Obstacles are inflated by `sigmas` standard deviations of their position.
        """
        minimum, *others = [moving.gap(*center, times, sigmas) for center in self._centers_at(x, y, yaw)]
        for gap in others:
            np.minimum(minimum, gap, out=minimum)
        minimum -= self.radius
        return minimum

    def nearness(
        self, moving: MovingObstacles, x: Reals, y: Reals, yaw: Reals, times: Reals, margin: float
    ) -> tuple[Reals, Mask]:
        """Return the nearness (…,) of the nearest moving obstacle at `times` in s, and whether any touches a disc.

        The nearness is 1 at contact, and 0 at a distance of `margin` m plus one standard deviation of the position.
        """
        centers = self._centers_at(x, y, yaw)
        (maximum, in_contact), *others = [moving.nearness(*each, times, self.radius, margin) for each in centers]
        for nearness, contact in others:
            np.maximum(maximum, nearness, out=maximum)
            in_contact |= contact
        return maximum, in_contact

    def _centers_at(self, x: Reals, y: Reals, yaw: Reals) -> list[tuple[Reals, Reals]]:
        """Return x (…,) and y (…,) of the center of each disc, for poses (…,)."""
        if self.is_centered:
            return [(x, y)]
        cosine, sine = np.cos(yaw), np.sin(yaw)
        return [(x + offset * cosine, y + offset * sine) for offset in self.offsets.tolist()]


def _inner_points(corners: Array, resolution: float, inscribed: float) -> Array:
    """Return points (n, 2) of the footprint outside its inscribed circle, at least one per costmap cell."""
    spacing = resolution / math.sqrt(2.0)
    low, high = corners.min(axis=0), corners.max(axis=0)
    axes = [np.arange(a + spacing, b, spacing) for a, b in zip(low.tolist(), high.tolist(), strict=True)]
    points = np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 2)
    inside = points_in_polygon(corners.tolist(), points)
    return np.asarray(points[inside & (np.hypot(points[:, 0], points[:, 1]) > inscribed - resolution)])


def _edge_distances(corners: Array, points: Array) -> Array:
    """Return distances (n,) from points (n, 2) to the nearest edge of the polygon."""
    distance: Array = np.full(len(points), np.inf)
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        along = np.clip((points - a) @ (b - a) / float((b - a) @ (b - a)), 0.0, 1.0)
        np.minimum(distance, np.hypot(*(points - a - along[:, None] * (b - a)).T), out=distance)
    return distance


def _edge_points(corners: Array, resolution: float) -> Array:
    """Return points (n, 2) along the footprint's edge, at most one cell apart."""
    points = []
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        count = max(1, math.ceil(float(np.hypot(*(b - a))) / resolution))
        points.append(a + (b - a) * (np.arange(count) / count)[:, None])
    return np.concatenate(points)
