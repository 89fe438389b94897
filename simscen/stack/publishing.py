"""Output of a stack: plans, local plans, beliefs, costmaps, and events about components that hold the robot."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from simscen.core.environment.occupancy_grid import UNKNOWN, OccupancyGrid
from simscen.core.geometry import Pose2
from simscen.core.messages.navigation import Belief, Path
from simscen.core.records.events import Event, EventKind
from simscen.core.records.trace import CostGrid
from simscen.stack.costmap.costmaps import Costmaps
from simscen.stack.costmap.layered_costmap import LayeredCostmap
from simscen.stack.frames import Frames, transform_poses
from simscen.stack.kinematics import LOCAL_PLAN_TIMES_S, arc_poses
from simscen.stack.protocols import Controller, Localizer, SupportsArc

BELIEF_RATE_HZ, LOCAL_PLAN_RATE_HZ = 10.0, 5.0
"""Rate at which the belief is published if no scans arrive, and maximum rate of local plans."""
MAX_CELLS_PER_SECOND = 125_000
"""Maximum number of cells published per second for each costmap, which limits the rate of large costmaps."""
_OCCUPANCY_TABLE = np.array(
    [0, *(1 + 97 * (cost - 1) // 251 for cost in range(1, 253)), 99, 100, UNKNOWN], dtype=np.int8
).tobytes()
"""Published occupancy for each cost 0 … 255, as in nav2_costmap_2d: 1 … 252 → 1 … 98, 253 → 99, 254 → 100."""


Updates = tuple[Path | None, Path | None, tuple[CostGrid, ...]]
"""Plan, local plan, and costmaps to publish; None or empty if there is nothing new."""
NO_UPDATES: Updates = (None, None, ())


class Publisher:
    """Selects the plans, beliefs, and costmaps to publish: only changes, and at limited rates."""

    def __init__(
        self, tick_rate: int, localizer: Localizer, controller: Controller, local_frame: Literal["map", "odom"] = "odom"
    ) -> None:
        """Take the tick rate in Hz, the components to publish from, and the frame of the local costmap."""
        self._localizer, self._controller, self._tick_rate = localizer, controller, tick_rate
        self._belief_period = math.ceil(tick_rate / BELIEF_RATE_HZ)
        self._local_plan_period = math.ceil(tick_rate / LOCAL_PLAN_RATE_HZ)
        self.belief_due = 0
        """Tick from which the belief is published even without a scan."""
        self._local_plan_due = self._local_plan_period
        self._arc_controller = controller if isinstance(controller, SupportsArc) else None
        self._plan: Path | None = None
        self._global_costmap = _CostmapPublisher("global", "map")
        self._local_costmap = _CostmapPublisher("local", local_frame)

    def belief(self, tick: int) -> Belief:
        """Return the belief to publish at this tick. Call this method after each scan, and at the tick `belief_due`."""
        self.belief_due = tick + self._belief_period
        return self._localizer.belief

    def updates(self, tick: int, frames: Frames, plan: Path | None, costmaps: Costmaps) -> Updates:
        """Return what to publish after a controller period. `plan` is the path that the robot follows, if any."""
        local_plan: Path | None = None
        grids: tuple[CostGrid, ...] = ()
        if plan is not None and tick >= self._local_plan_due:
            local_plan = self._map_local_plan(tick, frames)
        if tick >= self._global_costmap.due or tick >= self._local_costmap.due:
            pairs = (self._global_costmap, costmaps.global_costmap), (self._local_costmap, costmaps.local_costmap)
            updates = (each.update(tick, costmap, self._tick_rate) for each, costmap in pairs if tick >= each.due)
            grids = tuple(grid for grid in updates if grid is not None)
        if plan is None or plan is self._plan:
            return NO_UPDATES if local_plan is None and not grids else (None, local_plan, grids)
        self._plan = plan
        return plan, local_plan, grids

    def _map_local_plan(self, tick: int, frames: Frames) -> Path | None:
        """Return the controller's local plan in the map frame."""
        self._local_plan_due = tick + self._local_plan_period
        if self._arc_controller is not None:
            arc = self._arc_controller.arc
            if arc is None:
                return None
            return Path(arc_poses(frames.map_from_odom.compose(arc[0]), arc[1], LOCAL_PLAN_TIMES_S))
        plan = self._controller.local_plan
        return None if plan is None else Path(transform_poses(frames.map_from_odom, plan.points), plan.tick)


@dataclass
class _CostmapPublisher:
    """Publisher of one costmap.

    due:       tick of the next publication
    revision:  revision of the costmap that was published last; -1 before the first publication
    """

    name: str
    frame: str
    due: float = 0
    revision: int = -1

    def update(self, tick: int, costmap: LayeredCostmap, tick_rate: int) -> CostGrid | None:
        """Return the costmap to publish; None if it has not changed or is never published."""
        if costmap.publish_frequency == 0.0:
            self.due = math.inf
            return None
        view = costmap.view
        period = max(1 / costmap.publish_frequency, view.costs.size / MAX_CELLS_PER_SECOND)
        self.due = tick + math.ceil(tick_rate * period)
        if view.revision == self.revision:
            return None
        self.revision = view.revision
        cells = np.frombuffer(view.costs.tobytes().translate(_OCCUPANCY_TABLE), dtype=np.int8).reshape(view.costs.shape)
        grid = OccupancyGrid(cells, view.resolution, Pose2(*view.origin))
        return CostGrid(self.name, self.frame, grid)


REPORT_AFTER_S = 1.0
"""Time for which a component must hold the robot before an event reports the hold."""


class StandstillReporter:
    """Returns an event when a component has kept the robot from driving for REPORT_AFTER_S, and when the hold ends."""

    def __init__(self, tick_rate: int) -> None:
        self._report_after_ticks = round(REPORT_AFTER_S * tick_rate)
        self.holder = ""
        """Name of the component that holds the robot; empty if none does."""
        self._hold_start_tick, self._is_reported = 0, False

    def report_hold(self, tick: int, component: str, reason: Callable[[], str]) -> tuple[Event, ...]:
        """Record that a component holds the robot, and return new events. `reason` returns the message of the event."""
        ended: tuple[Event, ...] = ()
        if component != self.holder:
            ended = self.report_release(tick)
            self.holder, self._hold_start_tick = component, tick
        if self._is_reported or tick - self._hold_start_tick < self._report_after_ticks:
            return ended
        self._is_reported = True
        return (*ended, Event(tick, EventKind.ROBOT_HELD, component, {"message": reason()}))

    def report_release(self, tick: int) -> tuple[Event, ...]:
        """Record that no component holds the robot any more, or that the robot has no goal. Return new events."""
        if not self.holder:
            return ()
        component, is_reported, self.holder, self._is_reported = self.holder, self._is_reported, "", False
        return (Event(tick, EventKind.ROBOT_RELEASED, component),) if is_reported else ()
