"""The planner: finds free start and goal cells, searches a path, and returns its poses."""

import math
from itertools import pairwise

import numpy as np

from simscen.plugin import Array, CostmapView, ErrorCode, NavigationFailure, Path, Pose2, Setting, distances
from theta_star.search import XY, Grid, lazy_theta_star
from theta_star.spec import ThetaStar

LETHAL = 254
SPACING = 0.05
"""Meters between two poses of a path; simscen asks for at most 0.1."""
WAY_OUT = 0.5
"""Meters that the robot may have to go until it is as far from obstacles as it would like."""


class ThetaStarPlanner:
    """Plans for the disc around the robot's hull, so that its heading never matters."""

    def __init__(self, spec: ThetaStar, setting: Setting) -> None:
        self._spec, self._footprint = spec, setting.footprint
        self._radius = setting.robot.circumscribed_radius

    def plan(self, costmap: CostmapView, start: Pose2, goal: Pose2, seed: int) -> Path:
        """A path of poses in the map frame. It draws no chance, so `seed` does not matter."""
        _look(costmap, start, ErrorCode.START_OUTSIDE_MAP, ErrorCode.START_OCCUPIED, "start")
        _look(costmap, goal, ErrorCode.GOAL_OUTSIDE_MAP, ErrorCode.GOAL_OCCUPIED, "goal")
        failure = NavigationFailure(ErrorCode.NO_VALID_PATH, "there is no way for a robot of this size")
        for part in (1.0, 0.5, 0.0):
            room = self._radius + part * self._spec.clearance + costmap.resolution / 2
            try:
                points = self._with_room(costmap, start, goal, room)
            except NavigationFailure as narrow:
                failure = narrow
                continue
            if self._footprint.free(costmap, points)[1:].all():
                return Path(points)
        raise failure

    def _with_room(self, costmap: CostmapView, start: Pose2, goal: Pose2, room: float) -> Array:
        grid = Grid(costmap, max(self._spec.grid, costmap.resolution), room)
        begin = grid.nearest((start.x, start.y), WAY_OUT)
        if begin is None:
            raise NavigationFailure(ErrorCode.START_OCCUPIED, f"no place with {room:.2f} m of room near the start")
        end = grid.nearest((goal.x, goal.y), self._spec.tolerance)
        if end is None:
            raise NavigationFailure(ErrorCode.GOAL_OCCUPIED, f"no place with {room:.2f} m of room near the goal")
        corners = lazy_theta_star(grid, begin, end)
        if corners is None:
            raise NavigationFailure(ErrorCode.NO_VALID_PATH, "there is no way for a robot of this size")
        whole = distances(costmap, np.array([goal.x, goal.y])) > room
        ends = [(start.x, start.y), *corners, *([(goal.x, goal.y)] if whole else [])]
        return _poses(np.array(_without_needless_ends(grid, ends)), start, goal.yaw)


def _without_needless_ends(grid: Grid, corners: list[XY]) -> list[XY]:
    """Without the cells nearest to start and goal, where the corner behind them is in sight."""
    if len(corners) > 2 and grid.clear(corners[0], corners[2]):
        corners = [corners[0], *corners[2:]]
    if len(corners) > 2 and grid.clear(corners[-3], corners[-1]):
        corners = [*corners[:-2], corners[-1]]
    return corners


def _look(costmap: CostmapView, pose: Pose2, outside: ErrorCode, occupied: ErrorCode, what: str) -> None:
    row, column = (math.floor((at - low) / costmap.resolution)
                   for at, low in zip((pose.y, pose.x), reversed(costmap.origin), strict=True))  # fmt: skip
    height, width = costmap.costs.shape
    if not (0 <= row < height and 0 <= column < width):
        raise NavigationFailure(outside, f"the {what} is not on the costmap")
    if costmap.costs[row, column] == LETHAL:
        raise NavigationFailure(occupied, f"the {what} is in an obstacle")


def _poses(corners: Array, start: Pose2, yaw: float) -> Array:
    """Poses (n, 3) at most SPACING apart, each heading along its stretch; the first is the start, the last turned."""
    corners = corners[np.append(True, np.hypot(*np.diff(corners, axis=0).T) > 1e-6)]
    stretches = []
    for a, b in pairwise(corners):
        count = max(1, math.ceil(float(np.hypot(*(b - a))) / SPACING))
        xy = a + (b - a) * (np.arange(count) / count)[:, None]
        stretches.append(np.column_stack((xy, np.full(count, math.atan2(b[1] - a[1], b[0] - a[0])))))
    last = np.array([[*corners[-1], yaw]])
    points = np.concatenate((*stretches, last))
    if len(points) == 1:
        points = np.concatenate((np.array([start]), last))
    return points
