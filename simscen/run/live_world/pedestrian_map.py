"""Static world of pedestrians: the walls that block them, and their paths around walls."""

from functools import cached_property

import numpy as np

from simscen.core.environment.world_model import BuiltWorld
from simscen.core.geometry import Pose2
from simscen.pedestrians.crowd import Point
from simscen.pedestrians.surroundings import WallMap
from simscen.worlds.geometry.cross_section import cross_section
from simscen.worlds.routes.shortest_paths import ShortestPaths, shortest_paths_in

OBSTACLE_HEIGHTS_M = (0.15, 0.5, 0.95)
"""Heights at which walls block pedestrians; walls at the last height also block their view."""
BODY_HEIGHT_RANGE_M = (0.05, 1.7)
"""Range of heights above the ground in which an object blocks a pedestrian."""
PATH_CELL_M = 0.1
"""Cell size of the grid for path planning."""
PREFERRED_CLEARANCE_M = 0.2
"""Clearance that planned paths keep where there is enough space."""


class PedestrianMap:
    """Walls and paths of pedestrians in a built world. Both are computed when they are first needed."""

    def __init__(self, built: BuiltWorld) -> None:
        self._built = built
        self._planners: dict[float, ShortestPaths] = {}

    @cached_property
    def walls(self) -> WallMap:
        """Walls that block pedestrians."""
        cuts = [cross_section(self._built.mesh, height) for height in OBSTACLE_HEIGHTS_M]
        opaque = np.concatenate([np.full(len(cut.owners), cut is cuts[-1]) for cut in cuts])
        owners = np.concatenate([cut.owners for cut in cuts]).astype(np.int64)
        return WallMap(np.concatenate([cut.segments for cut in cuts]), owners, opaque)

    def plan_path(self, start: Point, goal: Point, radius: float) -> list[Point]:
        """Return a path around walls, with extra clearance if possible; a straight line if there is no path."""
        for clearance in (radius + PREFERRED_CLEARANCE_M, radius):
            if clearance not in self._planners:
                self._planners[clearance] = shortest_paths_in(
                    self._built, (), clearance, BODY_HEIGHT_RANGE_M, PATH_CELL_M
                )
            corners = self._planners[clearance].path(Pose2(*start, 0.0), Pose2(*goal, 0.0))
            if corners is not None:
                return [(x, y) for x, y in corners[1:].tolist()]
        return [goal]
