"""What a stack publishes, and how often: nothing twice, and beliefs and arcs no faster than anybody looks."""

import math
from dataclasses import dataclass

import numpy as np

from simscen.core.belief import Belief
from simscen.core.geometry import Pose2
from simscen.core.grid import UNKNOWN, OccupancyGrid
from simscen.core.navigation import Path
from simscen.core.trace import CostGrid
from simscen.stack.costmap.costmaps import Costmaps
from simscen.stack.frames import Frames, placed
from simscen.stack.protocols import Controller, CostmapView, Localizer

BELIEF_RATE, LOCAL_PLAN_RATE = 10.0, 5.0
"""Hz: of beliefs without a scan, and of local plans."""
GLOBAL_RATE, LOCAL_RATE = 0.5, 1.0
"""Hz: of costmaps, for the eye alone; half of Nav2's, and slower where one is large."""
CELLS_A_SECOND = 125_000
"""Of each costmap; a large one is published so much more rarely."""
# As nav2_costmap_2d's publisher translates costs: 1 … 252 become 1 … 98.
_PUBLISHED = np.array([0, *(1 + 97 * (cost - 1) // 251 for cost in range(1, 253)), 99, 100, UNKNOWN], dtype=np.int8)


class Publishing:
    """Picks what is new."""

    def __init__(self, tick_rate: int, localizer: Localizer, controller: Controller) -> None:
        self._localizer, self._controller, self._tick_rate = localizer, controller, tick_rate
        self._belief_period = math.ceil(tick_rate / BELIEF_RATE)
        self._local_plan_period = math.ceil(tick_rate / LOCAL_PLAN_RATE)
        self._belief_told = -self._belief_period
        self._local_plan_told = 0
        self._plan: Path | None = None
        self._driving = False
        self._wide, self._near = _Drawn("global", "map", GLOBAL_RATE), _Drawn("local", "odom", LOCAL_RATE)

    def belief(self, tick: int, scanned: bool) -> Belief | None:
        """The belief with each scan, and without one at BELIEF_RATE."""
        if not scanned and tick - self._belief_told < self._belief_period:
            return None
        self._belief_told = tick
        return self._localizer.belief

    def plan(self, plan: Path | None) -> Path | None:
        """The plan, once."""
        self._driving = plan is not None
        if plan is self._plan or plan is None:
            return None
        self._plan = plan
        return plan

    def local_plan(self, tick: int, frames: Frames) -> Path | None:
        """What the controller expects to drive, in the map frame, while there is a plan to follow."""
        if not self._driving or tick - self._local_plan_told < self._local_plan_period:
            return None
        self._local_plan_told = tick
        plan = self._controller.local_plan
        return None if plan is None else Path(placed(frames.map_from_odom, plan.points), plan.tick)

    def costmaps(self, tick: int, costmaps: Costmaps) -> tuple[CostGrid, ...]:
        """Both costmaps, each at its rate and when it has changed."""
        if tick < self._wide.due and tick < self._near.due:
            return ()
        both = (self._wide, costmaps.wide), (self._near, costmaps.near)
        found = (one.published(tick, costmap.view, self._tick_rate) for one, costmap in both if tick >= one.due)
        return tuple(grid for grid in found if grid is not None)


@dataclass
class _Drawn:
    """What was published of a costmap, and the tick from which on it may be again."""

    name: str
    frame: str
    rate: float
    due: int = 0
    revision: int = -1

    def published(self, tick: int, view: CostmapView, tick_rate: int) -> CostGrid | None:
        """The costmap now; None where nothing has changed in it."""
        self.due = tick + math.ceil(tick_rate * max(1 / self.rate, view.costs.size / CELLS_A_SECOND))
        if view.revision == self.revision:
            return None
        self.revision = view.revision
        grid = OccupancyGrid(_PUBLISHED[view.costs], view.resolution, Pose2(*view.origin))
        return CostGrid(self.name, self.frame, grid)
