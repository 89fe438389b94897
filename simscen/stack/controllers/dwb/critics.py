"""Critics of DWB, which score the end of each trajectory (dwb_critics).

Raw scores are in cells, costs, rad or rad/s and are multiplied by the scale of the critic. As in Nav2, the scales of
critics that count cells are multiplied by half the resolution. MapGridCritic propagates Manhattan distances through
all cells, obstacles included; here, they are computed in closed form.
"""

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.model.controllers import DynamicWindow as DwbSpec
from simscen.stack.protocols import CostmapView

Cells = npt.NDArray[np.int64]
Mask = npt.NDArray[np.bool_]
UNKNOWN = 255


@dataclass(frozen=True, eq=False)
class Scores:
    """Raw scores (n,) by Nav2's names of the critics, each with its scale, and which trajectories (n,) are legal."""

    raw: dict[str, Array]
    scale: dict[str, float]
    legal: Mask

    @property
    def total(self) -> Array:
        """The weighted sums (n,); infinite where a critic with a scale forbids the trajectory."""
        total = np.zeros(len(self.legal))
        for name, raw in self.raw.items():
            total += self.scale[name] * raw
        return np.where(self.legal, total, np.inf)


def score_trajectories(
    spec: DwbSpec, costmap: CostmapView, pose: Pose2, goal: Pose2, plan: Array, velocities: Array, ends: Array
) -> Scores:
    """Return the scores of trajectories with these end poses (n, 3); the plan (m, 2) has at least one point."""
    ahead = spec.forward_point_distance
    nose = ends[:, :2] + ahead * np.column_stack((np.cos(ends[:, 2]), np.sin(ends[:, 2])))
    last, on_map = cells_of(costmap, ends[:, :2])
    front, seen = cells_of(costmap, nose)
    near = pose.distance(goal) <= ahead
    half = 0.5 * costmap.resolution
    scale = {
        "BaseObstacle": spec.base_obstacle_scale,
        "GoalAlign": half * spec.goal_align_scale,
        "PathAlign": 0.0 if near else half * spec.path_align_scale,
        "PathDist": half * spec.path_dist_scale,
        "GoalDist": half * spec.goal_dist_scale,
        "Twirling": spec.twirling_scale,
    }
    path, drawn = plan_cells(costmap, plan), plan_cells(costmap, _drawn_ahead(plan, pose, goal, ahead))
    legal = on_map & (seen if scale["GoalAlign"] or scale["PathAlign"] else True)
    rows, columns = np.clip(last.T, 0, np.array(costmap.costs.shape)[:, None] - 1)
    raw = {
        "BaseObstacle": costmap.costs[rows, columns].astype(np.float64),
        "GoalAlign": _apart(front, drawn[-1:]),
        "PathAlign": _apart(front, path),
        "PathDist": _apart(last, path),
        "GoalDist": _apart(last, path[-1:]),
        "Twirling": np.abs(velocities[:, 2]),
    }
    return Scores(raw, scale, legal)


def _apart(cells: Cells, sources: Cells) -> Array:
    """Nothing to go by off the costmap: then all are alike."""
    return manhattan(cells, sources) if len(sources) else np.zeros(len(cells))


def _drawn_ahead(plan: Array, pose: Pose2, goal: Pose2, distance: float) -> Array:
    """Return the plan with its end moved beyond the goal, as seen from the robot, for the GoalAlign critic."""
    angle = np.arctan2(goal.y - pose.y, goal.x - pose.x)
    drawn = plan.copy()
    drawn[-1] += distance * np.array((np.cos(angle), np.sin(angle)))
    return np.asarray(drawn)


def cells_of(costmap: CostmapView, points: Array) -> tuple[Cells, Mask]:
    """Cells (n, 2) as (row, column) under points (n, 2), and which lie on the costmap."""
    cells = np.floor((points[:, ::-1] - np.array(costmap.origin)[::-1]) / costmap.resolution).astype(np.int64)
    on_map: Mask = np.asarray(((cells >= 0) & (cells < np.array(costmap.costs.shape))).all(axis=1))
    return cells, on_map


def plan_cells(costmap: CostmapView, plan: Array) -> Cells:
    """Return the cells (m, 2) of the plan (n, 2) from where it enters the known costmap to where it leaves it."""
    cells, on_map = cells_of(costmap, plan)
    known = on_map.copy()
    known[on_map] = costmap.costs[cells[on_map, 0], cells[on_map, 1]] != UNKNOWN
    if not known.any():
        return cells[:0]
    first = int(known.argmax())
    gone = np.flatnonzero(~known[first:])
    return cells[first : first + int(gone[0])] if len(gone) else cells[first:]


def manhattan(cells: Cells, sources: Cells) -> Array:
    """Return the Manhattan distance (n,) in cells from cells (n, 2) to the nearest of the sources (m, 2)."""
    apart = np.abs(cells[:, None, 0] - sources[None, :, 0]) + np.abs(cells[:, None, 1] - sources[None, :, 1])
    return np.asarray(apart.min(axis=1), dtype=np.float64)


class RotateToGoalCritic:
    """Demands that the robot slows down at the goal, then that it only turns; scores by how far off its heading is."""

    def __init__(self, stopped: float, slowing: float) -> None:
        self._stopped, self._slowing = stopped, slowing
        self.reset()

    def reset(self) -> None:
        """Forget the state of the previous goal."""
        self._rotating = False

    def scores(self, now: Twist, goal_yaw: float, velocities: Array, end_yaws: Array) -> tuple[Array, Mask]:
        """Scores (n,) at the goal and which velocities (n, 3) are legal there; end_yaws (n,) are where they lead."""
        speed = math.hypot(now.vx, now.vy)
        self._rotating |= speed <= self._stopped
        square = velocities[:, 0] ** 2 + velocities[:, 1] ** 2
        off = np.abs((end_yaws - goal_yaw + np.pi) % (2.0 * np.pi) - np.pi)
        if self._rotating:
            return off, np.asarray(square == 0.0)
        return np.asarray(square * self._slowing + off), np.asarray(square < speed**2)
