"""Input of the MPPI critics: rollouts, path ahead, and obstacles (nav2_mppi_controller's CriticData)."""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose2
from simscen.model.mppi import MppiCostCritic, MppiObstaclesCritic, MppiTrajectoryValidator
from simscen.stack.controllers.mppi.rollouts import Floats, Rollouts
from simscen.stack.controllers.path_handler import UpcomingPath
from simscen.stack.footprint import CoveringDiscs, Footprint
from simscen.stack.kinematics import VelocityLimits
from simscen.stack.moving_obstacles import MAX_INFLATION_M, Mask, MovingObstacles
from simscen.stack.protocols import INSCRIBED, NO_INFORMATION, CostmapView

MOVING_CLEARANCE_M = 0.25
"""Preferred clearance from moving obstacles, in addition to one standard deviation of their predicted position."""
COLLISION_DECAY_S = 1.2
"""Time constant of the exponential decay of the weight of predicted collisions with moving obstacles."""
ESCAPE_TOLERANCE_M = 0.01
"""Distance by which a robot that is already in collision may get deeper into the obstacle."""


class CellLookup(NamedTuple):
    """Points in the frame of the rollouts, with the costmap cell at each point.

    x, y:    coordinates (…,) in m
    cell:    flat index (…,) of the cell
    on_map:  mask (…,) of the points on the costmap; None if all points are on the costmap
    """

    x: Floats
    y: Floats
    cell: npt.NDArray[np.int32]
    on_map: Mask | None


@dataclass(frozen=True, eq=False)
class CriticData:
    """Input of the critics for n rollouts.

    The frame of the rollouts has its origin at the position of the robot, and the orientation of the costmap's frame.

    rollouts:   rollouts, in the frame of the rollouts
    plan:       plan ahead of the robot, in the costmap's frame
    pose:       pose of the robot in the costmap's frame
    goal_yaw:   heading of the goal in the costmap's frame
    limits:     velocity limits with the current speed limit
    dt:         time step in s
    tolerance:  position tolerance of the goal in m
    """

    rollouts: Rollouts
    plan: UpcomingPath
    pose: Pose2
    goal_yaw: float
    costmap: CostmapView
    footprint: Footprint
    limits: VelocityLimits
    dt: float
    tolerance: float

    @cached_property
    def path(self) -> tuple[Floats, Floats, Floats]:
        """x, y, and yaw (each (m,)) of the plan in the frame of the rollouts."""
        x, y, yaw = self.plan.points.T
        return (x - self.pose.x).astype(np.float32), (y - self.pose.y).astype(np.float32), yaw.astype(np.float32)

    @cached_property
    def furthest_point(self) -> int:
        """Index of the furthest point of the plan that any rollout reaches (Nav2's findPathFurthestReachedPoint).

        A rollout reaches the point nearest to its end, but no point beyond its own length along the plan.
        """
        x, y, _ = self.path
        length = self.rollouts.speed[1:].sum(axis=0) * np.float32(self.dt)
        reachable = np.minimum(np.ceil(length / max(self.plan.spacing, 1e-9) - 1e-4), len(x) - 1)
        squared, dy = np.subtract.outer(self.rollouts.x[-1], x), np.subtract.outer(self.rollouts.y[-1], y)
        squared *= squared
        dy *= dy
        squared += dy
        nearest = squared.argmin(axis=1)
        for rollout in np.flatnonzero(nearest > reachable).tolist():
            nearest[rollout] = squared[rollout, : int(reachable[rollout]) + 1].argmin()
        return int(nearest.max())

    @cached_property
    def free_points(self) -> Mask:
        """Mask (m,) of the points of the plan where the center of the robot may be: free or unknown cells."""
        costs = self.costs(self.lookup(*self.path[:2]))
        return np.asarray((costs < INSCRIBED) | (costs == NO_INFORMATION))

    @cached_property
    def moving(self) -> MovingObstacles:
        """Moving obstacles that may come near a rollout, in the frame of the rollouts."""
        rollouts, moving = self.rollouts, self.costmap.moving
        if not len(moving):
            return moving
        farthest, times = np.sqrt((rollouts.x * rollouts.x + rollouts.y * rollouts.y).max(axis=1)), self.times
        reach, speed = self.footprint.circumscribed + MAX_INFLATION_M, float((farthest / times).max())
        nearby = moving.near(self.pose.x, self.pose.y, reach, speed, float(times[-1]))
        return nearby.in_frame(Pose2(self.pose.x, self.pose.y, 0.0)) if len(nearby) else nearby

    @cached_property
    def times(self) -> Array:
        """Times (steps,) in s from now to the steps of the rollouts."""
        times: Array = self.dt * np.arange(1.0, len(self.rollouts.x) + 1.0)
        return times

    @cached_property
    def moving_obstacle_costs(self) -> tuple[Floats, Floats]:
        """Proximity costs (n,) and collision costs (n,) of the rollouts because of moving obstacles.

        The proximity cost is the weighted mean of the squared nearness, which is 1 at contact and 0 at
        MOVING_CLEARANCE_M plus one standard deviation. The collision cost is the weight of the first contact; 0 without
        contact. Weights decay exponentially with time.
        """
        rollouts, times = self.rollouts, self.times.astype(np.float32)[:, None]
        nearness, is_contact = self.footprint.discs.nearness(
            self.moving, rollouts.x, rollouts.y, rollouts.yaw, times, MOVING_CLEARANCE_M
        )
        decay = np.exp(-times / np.float32(COLLISION_DECAY_S))
        squared = np.clip(nearness, 0.0, 2.0)
        squared *= squared
        proximity: Floats = (squared * decay).mean(axis=0)
        collision: Floats = (is_contact * decay).max(axis=0)
        return proximity, collision

    @cached_property
    def _flat_costs(self) -> npt.NDArray[np.uint8]:
        return self.costmap.costs.ravel()

    @cached_property
    def _flat_distances(self) -> Floats:
        return self.costmap.distance.ravel()

    def lookup(self, x: Floats, y: Floats) -> CellLookup:
        """Return the costmap cells at points (…,) in the frame of the rollouts."""
        view = self.costmap
        scale, (height, width) = np.float32(1.0 / view.resolution), view.costs.shape
        column = x + np.float32(self.pose.x - view.origin[0])
        row = y + np.float32(self.pose.y - view.origin[1])
        column *= scale
        row *= scale
        on_map: Mask | None = None
        if column.min() < 0 or row.min() < 0 or column.max() >= width or row.max() >= height:
            on_map = np.asarray((row >= 0) & (column >= 0) & (row < height) & (column < width))
            column, row = np.clip(column, 0, width - 1), np.clip(row, 0, height - 1)
        cell = row.astype(np.int32)
        cell *= width
        cell += column.astype(np.int32)
        return CellLookup(x, y, cell, on_map)

    def costs(self, points: CellLookup) -> npt.NDArray[np.uint8]:
        """Return the costs (…,) at points; 0 off the costmap."""
        costs = self._flat_costs.take(points.cell)
        return costs if points.on_map is None else np.where(points.on_map, costs, np.uint8(0))

    def collides(self, clearance: Floats, consider_footprint: bool) -> Mask:
        """Return which rollouts (n,) collide, given their `clearance` (steps, n) in m.

        If the robot already is in collision, only rollouts that lead deeper into the obstacle collide.
        """
        current = self._current_clearance[consider_footprint]
        return np.asarray(clearance.min(axis=0) <= min(0.0, current - ESCAPE_TOLERANCE_M))

    @cached_property
    def _current_clearance(self) -> tuple[float, float]:
        """Clearance in m at the current pose: of the inscribed circle (index False), and of the footprint (True)."""
        origin, yaw = np.zeros((1, 1), np.float32), np.full((1, 1), self.pose.yaw, np.float32)
        points = self.lookup(origin, origin)
        inscribed, footprint = self.clearance(points, yaw, False), self.clearance(points, yaw, True)
        return float(inscribed[0, 0]), float(footprint[0, 0])

    def clearance(self, points: CellLookup, yaw: Floats, consider_footprint: bool) -> Floats:
        """Return distances (…,) in m from the robot, at points with headings `yaw`, to the nearest obstacle.

        Distances are negative in collision, and inf off the costmap. The robot is approximated by its inscribed circle
        or, with `consider_footprint`, by discs that cover its footprint.
        """
        discs: CoveringDiscs = self.footprint.discs
        if not consider_footprint:
            return np.asarray(self._distance(points) - np.float32(self.footprint.inscribed))
        if discs.is_centered:
            return np.asarray(self._distance(points) - np.float32(discs.radius))
        cosine, sine = np.cos(yaw), np.sin(yaw)
        nearest = np.full(points.x.shape, np.inf, np.float32)
        for offset in discs.offsets.astype(np.float32):
            center = self.lookup(points.x + offset * cosine, points.y + offset * sine)
            np.minimum(nearest, self._distance(center), out=nearest)
        return np.asarray(nearest - np.float32(discs.radius))

    def _distance(self, points: CellLookup) -> Floats:
        """Return the distances (…,) in m from points to the nearest lethal cell; inf off the costmap."""
        distance = self._flat_distances.take(points.cell)
        return distance if points.on_map is None else np.where(points.on_map, distance, np.float32(np.inf))


def considers_footprint(spec: MppiCostCritic | MppiObstaclesCritic | MppiTrajectoryValidator) -> bool:
    """Return the parameter `consider_footprint`. Its default None stands for true, unlike in Nav2."""
    return spec.consider_footprint is not False


def hypot_in_place(dx: Floats, dy: Floats) -> Floats:
    """Return the lengths of vectors (dx, dy), much faster than np.hypot. Overwrites the arguments."""
    dx *= dx
    dy *= dy
    dx += dy
    return np.sqrt(dx, out=dx)
