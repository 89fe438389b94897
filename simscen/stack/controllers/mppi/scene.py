"""What the critics are shown: the rollouts, the plan, and what is in the way."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Pose2
from simscen.stack.controllers.local_plan import LocalPlan
from simscen.stack.controllers.mppi.limits import Limits
from simscen.stack.controllers.mppi.rollouts import Rollouts
from simscen.stack.footprint import Discs, Footprint
from simscen.stack.protocols import CostmapView

Floats = npt.NDArray[np.float32]
Mask = npt.NDArray[np.bool_]
INSCRIBED, UNKNOWN = 253, 255
ESCAPE = 0.01
"""Metres: a robot in collision may go where it is no more than so much nearer to the obstacle."""


@dataclass(frozen=True, eq=False)
class Scene:
    """All that a critic may look at. Lengths in m; the frame has the robot at its origin, unrotated."""

    rolled: Rollouts
    plan: LocalPlan
    pose: Pose2
    goal_yaw: float
    costmap: CostmapView
    footprint: Footprint
    limits: Limits
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
        square = (x[:, None] - self.rolled.x[-1]) ** 2 + (y[:, None] - self.rolled.y[-1]) ** 2
        square[np.arange(len(x))[:, None] > reach] = np.inf
        return int(square.argmin(axis=0).max())

    @cached_property
    def free_points(self) -> Mask:
        """Which points (m,) of the plan the middle of the robot can be at, as far as is known."""
        costs = self.costs(*self.path[:2])
        return np.asarray((costs < INSCRIBED) | (costs == UNKNOWN))

    def costs(self, x: Floats, y: Floats) -> npt.NDArray[np.uint8]:
        """Costs (…,) at points (…,); 0 off the costmap."""
        rows, columns, on_map = self._cells(x, y)
        costs = self.costmap.costs[rows, columns]
        return costs if on_map.all() else np.where(on_map, costs, np.uint8(0))

    def hit(self, x: Floats, y: Floats, yaw: Floats, whole: bool) -> Mask:
        """Which poses (…,) touch something: with the whole hull, or with its inscribed circle.

        What lies off the costmap is taken for free. A robot that is in collision already, or whose discs are as they
        reach a little beyond its hull, may go anywhere but further into it, or it could never get out.
        """
        origin = np.zeros((1, 1), np.float32)
        here = float(self.gap(origin, origin, np.full((1, 1), self.pose.yaw, np.float32), whole)[0, 0])
        return np.asarray(self.gap(x, y, yaw, whole) <= min(0.0, here - ESCAPE))

    def gap(self, x: Floats, y: Floats, yaw: Floats, whole: bool) -> Floats:
        """Metres (…,) between the hull, or its inscribed circle, and the nearest obstacle."""
        discs: Discs = self.footprint.discs
        if not whole:
            return np.asarray(self._distance(x, y) - np.float32(self.footprint.inscribed))
        if len(discs.offsets) == 1 and discs.offsets[0] == 0.0:
            return np.asarray(self._distance(x, y) - np.float32(discs.radius))
        cosine, sine = np.cos(yaw), np.sin(yaw)
        least = np.full(x.shape, np.inf, np.float32)
        for offset in discs.offsets.astype(np.float32):
            np.minimum(least, self._distance(x + offset * cosine, y + offset * sine), out=least)
        return np.asarray(least - np.float32(discs.radius))

    def _distance(self, x: Floats, y: Floats) -> Floats:
        rows, columns, on_map = self._cells(x, y)
        near = self.costmap.distance[rows, columns]
        return near if on_map.all() else np.where(on_map, near, np.float32(np.inf))

    def _cells(self, x: Floats, y: Floats) -> tuple[npt.NDArray[np.int32], npt.NDArray[np.int32], Mask]:
        """Rows and columns under points, those off the costmap moved to its edge, and which are on it."""
        view = self.costmap
        scale = np.float32(1.0 / view.resolution)
        across = (x + np.float32(self.pose.x - view.origin[0])) * scale
        up = (y + np.float32(self.pose.y - view.origin[1])) * scale
        height, width = view.costs.shape
        on_map = (up >= 0) & (across >= 0) & (up < height) & (across < width)
        if on_map.all():
            return up.astype(np.int32), across.astype(np.int32), on_map
        rows = np.clip(up, 0, height - 1).astype(np.int32)
        return rows, np.clip(across, 0, width - 1).astype(np.int32), on_map
