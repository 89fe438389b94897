"""Recoveries of Nav2, as events of the run: behaviors that its behavior server executes, and clearing of costmaps.

A behavior is an action, whose status tells when it starts and how it ends. Clearing a costmap is a service, whose calls
are not visible; only the feedback of the navigation action counts it (`number_of_recoveries`, which counts behaviors,
too).
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
"""Simulated time after which a counted recovery that is no behavior is reported: its status may arrive later."""

Say = Callable[..., None]
"""Reports an event: `say("recovery.started", "spin")`."""


class Recoveries:
    """Reports each recovery once."""

    def __init__(self, graph: Graph, say: Say) -> None:
        self._graph, self._say = graph, say
        self._executing: dict[bytes, str] = {}
        self._known: set[bytes] = set()
        self._named = self._counted = self._latest = 0
        self._ahead_since: int | None = None

    def subscribe(self) -> None:
        """Follow the behaviors that the graph has now."""
        for behavior in BEHAVIORS:
            self._graph.follow_action(behavior, partial(self._take_all, behavior))

    def _take_all(self, behavior: str, message: Any) -> None:
        for goal in message.status_list:
            self._take(behavior, bytes(goal.goal_info.goal_id.uuid), goal.status)

    def _take(self, behavior: str, goal: bytes, status: int) -> None:
        if goal not in self._known and (status == EXECUTING or status in OUTCOMES):
            self._known.add(goal)
            self._executing[goal] = behavior
            self._named += 1
            self._say("recovery.started", behavior)
        if status in OUTCOMES and self._executing.pop(goal, None) is not None:
            self._say("recovery.ended", behavior, outcome=OUTCOMES[status])

    def counted(self, number: int) -> None:
        """Take the number of recoveries since the navigation action began, from its feedback."""
        self._counted += max(0, number - self._latest)
        self._latest = number

    def begin_goal(self) -> None:
        """Count from zero, as the feedback of a new navigation action does."""
        self._latest = 0

    def report_clearing(self, now: int) -> None:
        """Report counted recoveries that are no behavior as costmap clearing; `now` in nanoseconds."""
        if self._counted <= self._named:
            self._ahead_since = None
            return
        if self._ahead_since is None:
            self._ahead_since = now
        if now - self._ahead_since >= FEEDBACK_DELAY_NS:
            for _ in range(self._counted - self._named):
                self._say("recovery.started", CLEARING)
                self._say("recovery.ended", CLEARING, outcome="succeeded")
            self._named, self._ahead_since = self._counted, None
