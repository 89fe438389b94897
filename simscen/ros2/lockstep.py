"""Synchronization of one control period: publish sensor data, advance time, and collect the command.

**Lockstep.** While the simulation waits, a period with a due command consists of these steps:

1. Everything measured since the last period is published, message by message. After each message with a subscriber,
   a round of the node barrier follows, because a node may take two simultaneous messages in any order.
2. /clock publishes the time of the period.
3. At least two rounds follow. In the first, the nodes take the new time; in the second, the timers that became due have
   run. While there is no command, one more round per node follows, so that a command can pass through filters.
4. If there is still no command while driving to a goal, wait a short wall time for nodes that take /clock in a separate
   thread, as those of rclcpp do.
5. If a server of Nav2 executes an action that moves the robot, and its command is due, wait for it, at most `limit_s`
   of wall time. Without a command in the simulated second after that, the run ends with an error that names the node.

The command of the period is the last one received. Without one, the robot keeps its command, as a real robot would; the
adapter counts such periods. Time stands still within a control period: /clock publishes multiples of it only.

**Paced.** The simulation does not wait for the stack: a period begins at its wall time, and the newest command counts.
"""

import time
from typing import Any, Dict, List, Optional, Sequence, Tuple

from simscen.ros2.frames import transforms_first
from simscen.ros2.graph import Graph, Received
from simscen.ros2.messages import NANOSECONDS, read_header
from simscen.ros2.nav2.actions import MotionActions
from simscen.ros2.node_barrier import NodeBarrier
from simscen.ros2.options import AdapterError
from simscen.ros2.readiness import COMMAND, TWIST_STAMPED

Message = Tuple[str, bytes]
"""Topic of the protocol and CDR."""


class Lockstep:
    """The simulation waits for the stack."""

    def __init__(
        self, graph: Graph, barrier: NodeBarrier, actions: MotionActions, rounds: int, wait_s: float, limit_s: float
    ) -> None:
        """Take the graph, the barrier, and the limit of additional rounds without a command (0 = one per node)."""
        self._graph, self._barrier, self._actions = graph, barrier, actions
        self._extra_rounds, self._wait, self._limit = rounds, wait_s, limit_s
        self.counters: Dict[str, Any] = {"beats": 0, "without_command": 0, "late_commands": 0}

    def step(self, now: int, messages: Sequence[Message], due: bool, driving: bool) -> List[Received]:
        """Return the messages of the stack since the last step; `now` in nanoseconds, `driving` to a goal.

        Raises AdapterError that names a node whose command is overdue.
        """
        graph, barrier = self._graph, self._barrier
        for topic, data in transforms_first(messages):
            if graph.publish(topic, data):
                barrier.round()
        if not due:
            return _take_inbox(graph)
        start = len(graph.inbox)
        graph.publish_clock(now)
        for number in range(2 + (self._extra_rounds or len(barrier.nodes))):
            barrier.round()
            if number and _last_command(graph.inbox[start:]) is not None:
                break
        if driving:
            graph.spin_until(lambda: _last_command(graph.inbox[start:]) is not None, self._wait)
            self._wait_for_due_command(now, start)
        self._count(now, _last_command(graph.inbox[start:]))
        return _take_inbox(graph)

    def _wait_for_due_command(self, now: int, start: int) -> None:
        def late_server() -> List[str]:
            overdue = self._actions.overdue_command(now)
            commanded = overdue is None or _last_command(self._graph.inbox[start:]) is not None
            return [] if commanded or overdue is None else [overdue.node]

        if not self._barrier.step_time.wait_for(late_server, self._actions.wait_s(self._limit)):
            overdue = self._actions.record_missing(now)
            if overdue is not None:
                raise AdapterError(
                    f"{overdue.node} sends no commands, although it executes {overdue.action}: none within "
                    f"{self._limit:g} s of wall time, and none in the simulated second after that"
                )

    def _count(self, now: int, command: Optional[Received]) -> None:
        self.counters["beats"] += 1
        if command is None:
            self.counters["without_command"] += 1
            return
        self._actions.record_command(now)
        if command.type == TWIST_STAMPED and read_header(command.data)[0] < now:
            self.counters["late_commands"] += 1


class Paced:
    """The simulation runs at `factor` times real time and waits for nothing."""

    def __init__(self, graph: Graph, factor: float) -> None:
        self._graph, self._factor = graph, factor
        self._start: Optional[float] = None
        self.counters: Dict[str, Any] = {"beats": 0, "without_command": 0}

    def step(self, now: int, messages: Sequence[Message], due: bool, driving: bool) -> List[Received]:
        """Return the messages of the stack since the last step; `now` in nanoseconds."""
        elapsed = now / NANOSECONDS / self._factor
        start = time.monotonic() - elapsed
        # After a delay the rest of the run keeps its pace instead of catching up.
        self._start = start if self._start is None else max(self._start, start)
        due_at = self._start + elapsed
        self._graph.spin_until(lambda: time.monotonic() >= due_at, max(0.0, due_at - time.monotonic()))
        self._graph.publish_clock(now)
        for topic, data in transforms_first(messages):
            self._graph.publish(topic, data)
        self._graph.take_all()
        if due:
            self.counters["beats"] += 1
            self.counters["without_command"] += _last_command(self._graph.inbox) is None
        return _take_inbox(self._graph)


def _last_command(received: Sequence[Received]) -> Optional[Received]:
    return next((message for message in reversed(received) if message.topic == COMMAND), None)


def _take_inbox(graph: Graph) -> List[Received]:
    received, graph.inbox[:] = list(graph.inbox), []
    return received
