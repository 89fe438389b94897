"""What a stack publishes, and how often: nothing twice, and beliefs and arcs no faster than anybody looks."""

import math

from simscen.core.belief import Belief
from simscen.core.navigation import Path
from simscen.stack.frames import Frames, placed
from simscen.stack.protocols import Controller, Localizer

BELIEF_RATE, LOCAL_PLAN_RATE = 10.0, 5.0
"""Hz: of beliefs without a scan, and of local plans."""


class Publishing:
    """Picks what is new."""

    def __init__(self, tick_rate: int, localizer: Localizer, controller: Controller) -> None:
        self._localizer, self._controller = localizer, controller
        self._belief_period = math.ceil(tick_rate / BELIEF_RATE)
        self._local_plan_period = math.ceil(tick_rate / LOCAL_PLAN_RATE)
        self._belief_told = -self._belief_period
        self._local_plan_told = 0
        self._plan: Path | None = None

    def belief(self, tick: int, scanned: bool) -> Belief | None:
        """The belief with each scan, and without one at BELIEF_RATE."""
        if not scanned and tick - self._belief_told < self._belief_period:
            return None
        self._belief_told = tick
        return self._localizer.belief

    def plan(self, plan: Path | None) -> Path | None:
        """The plan, once."""
        if plan is self._plan or plan is None:
            return None
        self._plan = plan
        return plan

    def local_plan(self, tick: int, driving: bool, frames: Frames) -> Path | None:
        """What the controller expects to drive, in the map frame, while there is a plan to follow."""
        if not driving or tick - self._local_plan_told < self._local_plan_period:
            return None
        self._local_plan_told = tick
        plan = self._controller.local_plan
        return None if plan is None else Path(placed(frames.map_from_odom, plan.points), plan.tick)
