"""What a stack publishes, and how often: nothing twice, and beliefs and arcs no faster than anybody looks."""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from simscen.core.environment.occupancy_grid import UNKNOWN, OccupancyGrid
from simscen.core.geometry import Pose2
from simscen.core.messages.navigation import Belief, Path
from simscen.core.records.trace import CostGrid
from simscen.stack.arcs import LOCAL_PLAN_TIMES_S, arc_poses
from simscen.stack.costmap.costmaps import Costmaps
from simscen.stack.frames import Frames, transform_poses
from simscen.stack.protocols import Controller, CostmapView, Localizer, SupportsArc

BELIEF_RATE, LOCAL_PLAN_RATE = 10.0, 5.0
"""Hz: of beliefs without a scan, and of local plans."""
GLOBAL_RATE, LOCAL_RATE = 0.5, 1.0
"""Hz: of costmaps, for the eye alone; half of Nav2's, and slower where one is large."""
CELLS_A_SECOND = 125_000
"""Of each costmap; a large one is published so much more rarely."""
# As nav2_costmap_2d's publisher translates costs: 1 … 252 become 1 … 98.
_PUBLISHED = np.array(
    [0, *(1 + 97 * (cost - 1) // 251 for cost in range(1, 253)), 99, 100, UNKNOWN], dtype=np.int8
).tobytes()


Updates = tuple[Path | None, Path | None, tuple[CostGrid, ...]]
"""The plan, the local plan and costmaps, where they are new."""
NO_UPDATES: Updates = (None, None, ())


class Publisher:
    """Picks what is new."""

    def __init__(
        self, tick_rate: int, localizer: Localizer, controller: Controller, local_frame: Literal["map", "odom"] = "odom"
    ) -> None:
        """`local_frame` is what the local costmap is in."""
        self._localizer, self._controller, self._tick_rate = localizer, controller, tick_rate
        self._belief_period = math.ceil(tick_rate / BELIEF_RATE)
        self._local_plan_period = math.ceil(tick_rate / LOCAL_PLAN_RATE)
        self.belief_due = 0
        """The tick from which on the belief is told without a scan."""
        self._local_plan_due = self._local_plan_period
        self._arcs = controller if isinstance(controller, SupportsArc) else None
        self._plan: Path | None = None
        self._wide, self._near = _Drawn("global", "map", GLOBAL_RATE), _Drawn("local", local_frame, LOCAL_RATE)

    def belief(self, tick: int) -> Belief:
        """The belief; asked with each scan, and without one at BELIEF_RATE."""
        self.belief_due = tick + self._belief_period
        return self._localizer.belief

    def news(self, tick: int, frames: Frames, plan: Path | None, costmaps: Costmaps) -> Updates:
        """What is new after a step of the controller, which follows this plan."""
        local_plan: Path | None = None
        drawn: tuple[CostGrid, ...] = ()
        if plan is not None and tick >= self._local_plan_due:
            local_plan = self._driven(tick, frames)
        if tick >= self._wide.due or tick >= self._near.due:
            drawn = self._drawn(tick, costmaps)
        if plan is None or plan is self._plan:
            return NO_UPDATES if local_plan is None and not drawn else (None, local_plan, drawn)
        self._plan = plan
        return plan, local_plan, drawn

    def _driven(self, tick: int, frames: Frames) -> Path | None:
        """What the controller expects to drive, in the map frame."""
        self._local_plan_due = tick + self._local_plan_period
        if self._arcs is not None:
            driven = self._arcs.arc
            return (
                None
                if driven is None
                else Path(arc_poses(frames.map_from_odom.compose(driven[0]), driven[1], LOCAL_PLAN_TIMES_S))
            )
        plan = self._controller.local_plan
        return None if plan is None else Path(transform_poses(frames.map_from_odom, plan.points), plan.tick)

    def _drawn(self, tick: int, costmaps: Costmaps) -> tuple[CostGrid, ...]:
        """Both costmaps, each at its rate and when it has changed."""
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
        cells = np.frombuffer(view.costs.tobytes().translate(_PUBLISHED), dtype=np.int8).reshape(view.costs.shape)
        grid = OccupancyGrid(cells, view.resolution, Pose2(*view.origin))
        return CostGrid(self.name, self.frame, grid)
