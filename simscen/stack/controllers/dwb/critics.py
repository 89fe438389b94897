"""What DWB's trajectories are judged by: the scores of dwb_critics, which see the end of a trajectory.

Each raw score is counted in cells, costs, rad or rad/s, and weighs as much as its scale says; the scale of those that
count cells is for half a meter, whatever the costmap's resolution.
"""

from dataclasses import dataclass

import numpy as np

from simscen.core.geometry import Array, Pose2
from simscen.model.controllers import DynamicWindow as DwbSpec
from simscen.stack.controllers.dwb.map_grid import Cells, Mask, cells_of, manhattan, plan_cells
from simscen.stack.protocols import CostmapView


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


def scores(
    spec: DwbSpec, costmap: CostmapView, pose: Pose2, goal: Pose2, plan: Array, velocities: Array, ends: Array
) -> Scores:
    """Of trajectories that end at poses (n, 3), for a plan (m, 2) that lies on the costmap with at least one point."""
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
    """The plan with its end moved on, as seen from the robot: it is the robot's nose that GoalAlign draws there."""
    angle = np.arctan2(goal.y - pose.y, goal.x - pose.x)
    drawn = plan.copy()
    drawn[-1] += distance * np.array((np.cos(angle), np.sin(angle)))
    return np.asarray(drawn)
