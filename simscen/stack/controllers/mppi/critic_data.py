"""Data for the critics of MPPI: the rollouts, the local plan, and the obstacles (Nav2's CriticData)."""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose2
from simscen.stack.controllers.mppi.rollouts import Rollouts
from simscen.stack.controllers.path_handler import LocalPlan
from simscen.stack.controllers.velocity_limits import VelocityLimits
from simscen.stack.footprint import CoveringDiscs, Footprint
from simscen.stack.moving_obstacles import MAX_UNCERTAINTY_M, MovingObstacles
from simscen.stack.protocols import CostmapView

Floats = npt.NDArray[np.float32]
Mask = npt.NDArray[np.bool_]
INSCRIBED, UNKNOWN = 253, 255
MOVING_CLEARANCE_M = 0.25
"""Clearance of rollouts from moving obstacles, and standard deviation of the predicted positions."""
COLLISION_DECAY_S = 1.2
"""Seconds in which what may happen counts e times less."""
ESCAPE_TOLERANCE_M = 0.01
"""Distance by which a robot that is in collision may come nearer to the obstacle."""


class CellLookup(NamedTuple):
    """Points (…,) with the number of the costmap's cell under each; which lie on it, where not all do."""

    x: Floats
    y: Floats
    cell: npt.NDArray[np.int32]
    on_map: Mask | None


@dataclass(frozen=True, eq=False)
class CriticData:
    """All that a critic may look at. Lengths in m; the frame has the robot at its origin, unrotated."""

    rolled: Rollouts
    plan: LocalPlan
    pose: Pose2
    goal_yaw: float
    costmap: CostmapView
    footprint: Footprint
    limits: VelocityLimits
    dt: float
    tolerance: float

    @cached_property
    def path(self) -> tuple[Floats, Floats, Floats]:
        """x, y, yaw (m,) of the plan."""
        return self.plan.about(self.pose)

    @cached_property
    def furthest(self) -> int:
        """The furthest point of the plan that a rollout ends nearest to, no further along it than the rollout is long.

        nav2_mppi_controller's findPathFurthestReachedPoint.
        """
        x, y, _ = self.path
        length = self.rolled.speed[1:].sum(axis=0) * np.float32(self.dt)
        reach = np.minimum(np.ceil(length / max(self.plan.spacing, 1e-9) - 1e-4), len(x) - 1)
        square, up = np.subtract.outer(self.rolled.x[-1], x), np.subtract.outer(self.rolled.y[-1], y)
        square *= square
        up *= up
        square += up
        nearest = square.argmin(axis=1)
        for one in np.flatnonzero(nearest > reach).tolist():
            nearest[one] = square[one, : int(reach[one]) + 1].argmin()
        return int(nearest.max())

    @cached_property
    def free_points(self) -> Mask:
        """Which points (m,) of the plan the middle of the robot can be at, as far as is known."""
        costs = self.costs(self.spots(*self.path[:2]))
        return np.asarray((costs < INSCRIBED) | (costs == UNKNOWN))

    @cached_property
    def moving(self) -> MovingObstacles:
        """Moving obstacles that may come near a rollout, in the frame of the rollouts."""
        rolled, moving = self.rolled, self.costmap.moving
        if not len(moving):
            return moving
        gone, times = np.sqrt((rolled.x * rolled.x + rolled.y * rolled.y).max(axis=1)), self.times
        reach, speed = self.footprint.circumscribed + MAX_UNCERTAINTY_M, float((gone / times).max())
        near = moving.near(self.pose.x, self.pose.y, reach, speed, float(times[-1]))
        return near.seen_from(Pose2(self.pose.x, self.pose.y, 0.0)) if len(near) else near

    @cached_property
    def times(self) -> Array:
        """Seconds (steps,) from now to the steps of the rollouts."""
        times: Array = self.dt * np.arange(1.0, len(self.rolled.x) + 1.0)
        return times

    @cached_property
    def meeting(self) -> tuple[Floats, Floats]:
        """Mean nearness of each rollout (n,) to moving obstacles, and 1 for a collision.

        Both count less the later it is, for what moves may have turned by then.
        """
        rolled, times = self.rolled, self.times.astype(np.float32)[:, None]
        reached, touched = self.footprint.discs.nearness(
            self.moving, rolled.x, rolled.y, rolled.yaw, times, MOVING_CLEARANCE_M
        )
        soon = np.exp(-times / np.float32(COLLISION_DECAY_S))
        near = np.clip(reached, 0.0, 2.0)
        near *= near
        close: Floats = (near * soon).mean(axis=0)
        met: Floats = (touched * soon).max(axis=0)
        return close, met

    @cached_property
    def _costs(self) -> npt.NDArray[np.uint8]:
        return self.costmap.costs.ravel()

    @cached_property
    def _distances(self) -> Floats:
        return self.costmap.distance.ravel()

    def spots(self, x: Floats, y: Floats) -> CellLookup:
        """Return the cells below points (…,)."""
        view = self.costmap
        scale, (height, width) = np.float32(1.0 / view.resolution), view.costs.shape
        across, up = x + np.float32(self.pose.x - view.origin[0]), y + np.float32(self.pose.y - view.origin[1])
        across *= scale
        up *= scale
        on_map: Mask | None = None
        if across.min() < 0 or up.min() < 0 or across.max() >= width or up.max() >= height:
            on_map = np.asarray((up >= 0) & (across >= 0) & (up < height) & (across < width))
            across, up = np.clip(across, 0, width - 1), np.clip(up, 0, height - 1)
        cell = up.astype(np.int32)
        cell *= width
        cell += across.astype(np.int32)
        return CellLookup(x, y, cell, on_map)

    def costs(self, spots: CellLookup) -> npt.NDArray[np.uint8]:
        """Costs (…,) there; 0 off the costmap."""
        costs = self._costs.take(spots.cell)
        return costs if spots.on_map is None else np.where(spots.on_map, costs, np.uint8(0))

    def hit(self, gap: Floats, whole: bool) -> Mask:
        """Which rollouts (n,) touch something where they keep such a `gap` (steps, n) to it.

        What lies off the costmap is taken for free. A robot that is in collision already, or whose discs are as they
        reach a little beyond its hull, may go anywhere but further into it, or it could never get out.
        """
        return np.asarray(gap.min(axis=0) <= min(0.0, self._here[whole] - ESCAPE_TOLERANCE_M))

    @cached_property
    def _here(self) -> tuple[float, float]:
        """Distance in m of the nearest obstacle from the inscribed circle, and from the hull, at the robot's pose."""
        origin, yaw = np.zeros((1, 1), np.float32), np.full((1, 1), self.pose.yaw, np.float32)
        spots = self.spots(origin, origin)
        return float(self.gap(spots, yaw, False)[0, 0]), float(self.gap(spots, yaw, True)[0, 0])

    def gap(self, spots: CellLookup, yaw: Floats, whole: bool) -> Floats:
        """Return the distance (…,) in m between the hull, or its inscribed circle, and the nearest obstacle."""
        discs: CoveringDiscs = self.footprint.discs
        if not whole:
            return np.asarray(self._distance(spots) - np.float32(self.footprint.inscribed))
        if discs.centered:
            return np.asarray(self._distance(spots) - np.float32(discs.radius))
        cosine, sine = np.cos(yaw), np.sin(yaw)
        least = np.full(spots.x.shape, np.inf, np.float32)
        for offset in discs.offsets.astype(np.float32):
            disc = self.spots(spots.x + offset * cosine, spots.y + offset * sine)
            np.minimum(least, self._distance(disc), out=least)
        return np.asarray(least - np.float32(discs.radius))

    def _distance(self, spots: CellLookup) -> Floats:
        near = self._distances.take(spots.cell)
        return near if spots.on_map is None else np.where(spots.on_map, near, np.float32(np.inf))


def distances_in_place(dx: Floats, dy: Floats) -> Floats:
    """Distances from differences, which it uses up; np.hypot takes five times as long, for numbers past 1e19."""
    dx *= dx
    dy *= dy
    dx += dy
    return np.sqrt(dx, out=dx)
