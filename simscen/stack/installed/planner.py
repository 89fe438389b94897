"""A planner behind its door."""

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose2
from simscen.core.messages.navigation import Path
from simscen.model.planners import PlannerSpec
from simscen.stack.installed.guarded_calls import Watched
from simscen.stack.protocols import LETHAL, CostmapView, Planner
from simscen.stack.setting import Setting

AT_START = 0.05
"""Meters between the start that was asked for and the first point of a path, at most."""


class InstalledPlanner(Watched):
    """Asks the planner, and looks at its path before anybody follows it."""

    def __init__(self, spec: PlannerSpec, setting: Setting) -> None:
        super().__init__("planner", spec, setting, Planner)
        self._reach = setting.robot.circumscribed_radius

    def plan(self, costmap: CostmapView, start: Pose2, goal: Pose2, seed: int) -> Path:
        """The planner's path. Raises RunError when it is none, or leads through an obstacle."""
        path = self.checked_path(self.ask(self.inner.plan, costmap, start, goal, seed), "returned")
        points = path.points
        if not len(points):
            self.broke("returned a path without points instead of failing with NO_VALID_PATH")
        if np.hypot(points[0, 0] - start.x, points[0, 1] - start.y) > AT_START:
            self.broke(f"returned a path that begins at {_at(points[0])}, not at the start {_at(np.array(start))}")
        away = points[np.hypot(points[:, 0] - start.x, points[:, 1] - start.y) > self._reach]
        if len(away) and (struck := lethal(costmap, away)).any():
            self.broke(f"returned a path through an obstacle: the cell at {_at(away[struck.argmax()])} is lethal")
        return path


def lethal(costmap: CostmapView, points: Array) -> npt.NDArray[np.bool_]:
    """Which of the points (n, …) lie on a lethal cell; those off the costmap do not."""
    cells = np.floor((points[:, :2] - costmap.origin) / costmap.resolution)[:, ::-1]
    inside: npt.NDArray[np.bool_] = np.all((cells >= 0) & (cells < costmap.costs.shape), axis=1)
    rows, columns = np.where(inside[:, None], cells, 0).astype(np.int64).T
    struck: npt.NDArray[np.bool_] = inside & (costmap.costs[rows, columns] == LETHAL)
    return struck


def _at(point: Array) -> str:
    return f"({point[0]:.2f}, {point[1]:.2f})"
