"""Recoveries of Nav2, as events of the run: behaviors that its behavior server executes, and clearing of costmaps.

A behavior is an action; its status shows when it starts and how it ends. Clearing a costmap is a service, whose calls
are not visible; only the feedback of the navigation action counts it (`number_of_recoveries`, which also counts
behaviors).
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any, Callable

from simscen.ros2.messages import NANOSECONDS
from simscen.ros2.motion_actions import EXECUTING

if TYPE_CHECKING:
    from simscen.ros2.graph import Graph

BEHAVIORS = ("spin", "backup", "wait")
"""Actions of Nav2's behavior server that its behavior trees count as recoveries."""
CLEARING = "clear_costmap"
OUTCOMES = {4: "succeeded", 5: "canceled", 6: "failed"}
"""GoalStatus.STATUS_…"""
FEEDBACK_DELAY_NS = NANOSECONDS
"""Simulated time after which a counted recovery without a behavior is reported, because the status can arrive later."""

ReportEvent = Callable[..., None]
"""Reports an event: `report("recovery.started", "spin")`."""


class Recoveries:
    """Reports each recovery once."""

    def __init__(self, graph: Graph, report: ReportEvent) -> None:
        self._graph, self._report = graph, report
        self._executing: dict[bytes, str] = {}
        self._known: set[bytes] = set()
        self._behavior_count = self._feedback_count = self._last_number = 0
        self._excess_since: int | None = None

    def subscribe(self) -> None:
        """Subscribe to the status of the behaviors that exist in the graph now."""
        for behavior in BEHAVIORS:
            self._graph.follow_action(behavior, partial(self._process_statuses, behavior))

    def _process_statuses(self, behavior: str, message: Any) -> None:
        for goal in message.status_list:
            self._process_status(behavior, bytes(goal.goal_info.goal_id.uuid), goal.status)

    def _process_status(self, behavior: str, goal: bytes, status: int) -> None:
        if goal not in self._known and (status == EXECUTING or status in OUTCOMES):
            self._known.add(goal)
            self._executing[goal] = behavior
            self._behavior_count += 1
            self._report("recovery.started", behavior)
        if status in OUTCOMES and self._executing.pop(goal, None) is not None:
            self._report("recovery.ended", behavior, outcome=OUTCOMES[status])

    def update_count(self, number: int) -> None:
        """Update the count from `number`, the recoveries since the navigation action began as in its feedback."""
        self._feedback_count += max(0, number - self._last_number)
        self._last_number = number

    def begin_goal(self) -> None:
        """Count from zero, as the feedback of a new navigation action does."""
        self._last_number = 0

    def report_clearing(self, now: int) -> None:
        """Report counted recoveries without a behavior as costmap clearing; `now` in nanoseconds."""
        if self._feedback_count <= self._behavior_count:
            self._excess_since = None
            return
        if self._excess_since is None:
            self._excess_since = now
        if now - self._excess_since >= FEEDBACK_DELAY_NS:
            for _ in range(self._feedback_count - self._behavior_count):
                self._report("recovery.started", CLEARING)
                self._report("recovery.ended", CLEARING, outcome="succeeded")
            self._behavior_count, self._excess_since = self._feedback_count, None
