"""Wrapper that validates the decisions of a navigation stack: the reference stack, or a stack of another package."""

import numpy as np

from simscen.core.environment.costmap_filters import Zones
from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.goals import Goal
from simscen.core.messages.navigation import Belief, Estimate, Path
from simscen.core.messages.sensor_data import Odometry, Readings
from simscen.core.records.events import Event, EventKind
from simscen.core.records.trace import CostGrid, Decision
from simscen.model.stack import InProcessStack
from simscen.stack.protocols import Stack
from simscen.stack.setting import Setting
from simscen.stack.validation.plugin import CheckedPlugin


class CheckedStack(CheckedPlugin):
    """Wrapper of a stack that validates each new decision."""

    may_fail = False
    """A stack must not raise NavigationFailure."""

    def __init__(self, spec: InProcessStack, setting: Setting) -> None:
        super().__init__("stack", spec, setting, Stack)
        self._last_decision: Decision | None = None
        self._last_belief: Belief | None = None
        self._last_command: Twist | None = None

    def start(self, estimate: Estimate, goals: tuple[Goal, ...]) -> None:
        """Initialize the localizer with the estimate, and drive to the goals in order."""
        self.call(self.inner.start, estimate, goals)

    def preempt(self, tick: int, goal: Goal) -> None:
        """Replace the current goal by this one."""
        self.call(self.inner.preempt, tick, goal)

    def cancel(self, tick: int) -> None:
        """Cancel the current goal and all after it."""
        self.call(self.inner.cancel, tick)

    @property
    def can_switch_zones(self) -> bool:
        """Whether the stack can replace its zones during a run."""
        return callable(getattr(self.inner, "set_zones", None))

    def set_zones(self, tick: int, zones: Zones) -> None:
        """Replace all keepout and speed zones at the next costmap update."""
        self.call(self.inner.set_zones, tick, zones)

    def decide(self, tick: int, readings: Readings) -> Decision:
        """Return the stack's decision. Raises RunError if the decision is invalid."""
        try:
            decision = self.inner.decide(tick, readings)
        except Exception as error:  # as in `call`, without its overhead in every call
            self.raise_as_run_error(error)
        if self._last_decision is None or decision is not self._last_decision:  # the same object is not checked again
            self._last_decision = self._checked_decision(decision, tick)
        return self._last_decision

    @property
    def plan(self) -> Path | None:
        """The plan being followed; None without a plan."""
        plan = self.call(lambda: self.inner.plan)
        return None if plan is None else self.checked_path(plan, "returned as `plan`")

    @property
    def goal(self) -> Goal | None:
        """The current goal; None when the task has ended."""
        goal = self.call(lambda: self.inner.goal)
        if goal is not None and not isinstance(goal, Goal):
            self.raise_invalid(f"returned {goal!r} as `goal`, which is not a Goal")
        return goal

    def _checked_decision(self, decision: object, tick: int) -> Decision:
        """Return the decision if all parts are valid; otherwise raise RunError."""
        if not isinstance(decision, Decision):
            self.raise_invalid(f"returned {type(decision).__name__} instead of a Decision")
        if decision.command is not self._last_command:
            self._last_command = self.checked_twist(decision.command)
        if decision.belief is not None:
            self._last_belief = self.checked_belief(decision.belief, self._last_belief)
        if decision.plan is not None:
            self.checked_path(decision.plan, "returned in `Decision.plan`")
        if decision.local_plan is not None:
            self.checked_path(decision.local_plan, "returned in `Decision.local_plan`")
        self._check_messages(decision, tick)
        return decision

    def _check_messages(self, decision: Decision, tick: int) -> None:
        """Raise RunError if events, lines, costmaps, or odometry of the decision are invalid."""
        for name in ("events", "lines", "costmaps", "odometry"):
            if not isinstance(value := getattr(decision, name), tuple | list):
                self.raise_invalid(f"returned {type(value).__name__} as `Decision.{name}` instead of a tuple")
        for costmap in decision.costmaps:
            self._check_costmap(costmap)
        for odometry in decision.odometry:
            if not isinstance(odometry, Odometry):
                self.raise_invalid(f"published {type(odometry).__name__} instead of filtered Odometry")
        for event in decision.events:
            if not isinstance(event, Event) or not isinstance(event.kind, EventKind):
                self.raise_invalid(f"reported {event!r}, which is not an Event")
            if event.tick != tick:
                self.raise_invalid(f"reported `{event.kind}` of tick {event.tick} at tick {tick}")

    def _check_costmap(self, costmap: object) -> None:
        """Raise RunError if the name, the frame, or the cell type (int8) of a published costmap is wrong."""
        if not isinstance(costmap, CostGrid) or not isinstance(costmap.grid, OccupancyGrid):
            self.raise_invalid(f"published {type(costmap).__name__} instead of a CostGrid")
        if costmap.name not in ("global", "local") or costmap.frame not in ("map", "odom"):
            self.raise_invalid(f"published a costmap {costmap.name!r} in frame {costmap.frame!r}")
        cells = costmap.grid.cells
        if not isinstance(cells, np.ndarray) or cells.dtype != np.int8 or cells.ndim != 2:
            self.raise_invalid(f"published a {costmap.name} costmap whose cells are not an int8 array (height, width)")
