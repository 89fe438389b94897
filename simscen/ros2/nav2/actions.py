"""Observers of the actions of Nav2's servers: MotionActions finds overdue commands, RecoveryReporter recoveries.

**Overdue commands.** A server must send commands while it executes an action that moves the robot. The simulation waits
for commands, because the control loops of Nav2 up to Jazzy run on wall time and may be slower than the simulation.

**Recoveries.** A recovery is a behavior of Nav2's behavior server, or the clearing of a costmap. Behaviors are actions
with a visible status. Clearings are service calls, which other nodes cannot observe. The feedback of the navigation
action counts behaviors and clearings (`number_of_recoveries`).
"""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING, Any, Callable, NamedTuple

from simscen.ros2.messages import NS_PER_S
from simscen.ros2.node_parameters import NodeParameters

if TYPE_CHECKING:
    from simscen.ros2.graph import Graph
    from simscen.ros2.node_barrier import NodeBarrier

EXECUTING = 2
"""action_msgs/msg/GoalStatus.STATUS_EXECUTING."""
RATE_PARAMETERS = {
    "follow_path": "controller_frequency",
    "spin": "cycle_frequency",
    "backup": "cycle_frequency",
    "drive_on_heading": "cycle_frequency",
}
"""Actions that move the robot, and the server's parameter that sets the rate of commands in Hz."""
MAX_MISSING_NS = NS_PER_S
"""Simulated time after which the run fails if a due command has not arrived."""
NEXT_WAIT_S = 0.25
"""Maximum wall time to wait for a due command if the previous one did not arrive."""
BEHAVIORS = ("spin", "backup", "wait")
"""Actions of Nav2's behavior server that its behavior trees count as recoveries."""
CLEARING = "clear_costmap"
"""Name of the reported recovery if a costmap is cleared."""
OUTCOMES = {4: "succeeded", 5: "canceled", 6: "failed"}
"""Reported outcomes, by GoalStatus.status."""
FEEDBACK_DELAY_NS = NS_PER_S
"""Simulated time to wait for the status of a behavior before a counted recovery is reported as costmap clearing."""

ReportEvent = Callable[..., None]
"""Reports an event: `report("recovery.started", "spin")`."""


class OverdueCommand(NamedTuple):
    """A missing command: the node that must send it, and the action that the node executes."""

    node: str
    action: str


class _Server(NamedTuple):
    """Node with an action server that moves the robot, and the period of its commands."""

    node: str
    period_ns: float


class MotionActions:
    """Tracks the actions that move the robot, and the command that is due. `now` is simulated time in ns."""

    def __init__(self, graph: Graph, barrier: NodeBarrier) -> None:
        self._graph, self._parameters = graph, NodeParameters(graph, barrier)
        self._servers: dict[str, _Server] = {}
        self._executing: dict[str, bool] = {}
        self._last_command: int | None = None
        self._missing_since: int | None = None

    def subscribe(self) -> None:
        """Subscribe to the status of each action that has a server now."""
        for action, parameter in RATE_PARAMETERS.items():
            node = self._graph.subscribe_to_status(action, partial(self._process_status, action))
            rate = 0.0 if node is None else self._parameters.values(node, [parameter]).get(parameter) or 0.0
            if node is not None and rate > 0.0:
                self._servers[action] = _Server(node, NS_PER_S / rate)

    def _process_status(self, action: str, message: Any) -> None:
        self._executing[action] = any(goal.status == EXECUTING for goal in message.status_list)
        if not any(self._executing.values()):
            self._missing_since = None

    def record_command(self, now: int) -> None:
        """Record that a command arrived."""
        self._last_command, self._missing_since = now, None

    def wait_s(self, limit_s: float) -> float:
        """Return the wall time to wait for a due command: `limit_s`, or NEXT_WAIT_S if the last one did not arrive."""
        return limit_s if self._missing_since is None else min(limit_s, NEXT_WAIT_S)

    def record_missing(self, now: int) -> OverdueCommand | None:
        """Record that the due command did not arrive. Return this command if none has arrived for MAX_MISSING_NS."""
        overdue = self.overdue_command(now)
        self._missing_since = None if overdue is None else now if self._missing_since is None else self._missing_since
        is_late = self._missing_since is not None and now - self._missing_since >= MAX_MISSING_NS
        return overdue if is_late else None

    def overdue_command(self, now: int) -> OverdueCommand | None:
        """Return the command that is due now, or None. A command is due one period of the server after the last one."""
        for action, server in self._servers.items():
            since = server.period_ns if self._last_command is None else now - self._last_command
            if self._executing.get(action) and since >= server.period_ns:
                return OverdueCommand(server.node, action)
        return None


class RecoveryReporter:
    """Reports the start and the end of each recovery as events."""

    def __init__(self, graph: Graph, report: ReportEvent) -> None:
        self._graph, self._report = graph, report
        self._executing: set[bytes] = set()
        self._known: set[bytes] = set()
        self._behavior_count = self._feedback_count = self._last_number = 0
        self._excess_since: int | None = None

    def subscribe(self) -> None:
        """Subscribe to the status of each of the BEHAVIORS that has a server now."""
        for behavior in BEHAVIORS:
            self._graph.subscribe_to_status(behavior, partial(self._process_status, behavior))

    def _process_status(self, behavior: str, message: Any) -> None:
        """Report the recoveries that have started or ended."""
        for goal in message.status_list:
            goal_id, status = bytes(goal.goal_info.goal_id.uuid), goal.status
            if goal_id not in self._known and (status == EXECUTING or status in OUTCOMES):
                self._known.add(goal_id)
                self._executing.add(goal_id)
                self._behavior_count += 1
                self._report("recovery.started", behavior)
            if status in OUTCOMES and goal_id in self._executing:
                self._executing.remove(goal_id)
                self._report("recovery.ended", behavior, outcome=OUTCOMES[status])

    def update_count(self, number: int) -> None:
        """Update the count of recoveries. `number` is `number_of_recoveries` of the current navigation action."""
        self._feedback_count += max(0, number - self._last_number)
        self._last_number = number

    def begin_goal(self) -> None:
        """Begin a new navigation action, whose feedback counts recoveries from zero."""
        self._last_number = 0
        # Behaviors that the feedback of the last action did not count must not replace clearings of this one.
        self._feedback_count = max(self._feedback_count, self._behavior_count)

    def report_clearing(self, now: int) -> None:
        """Report recoveries in the count that are not behaviors as costmap clearings. `now` is simulated time in ns."""
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
