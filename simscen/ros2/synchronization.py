"""Synchronization of a run with the nodes: publish sensor data, advance ROS time, and collect velocity commands.

**Lockstep.** In each control period, the simulation waits for these steps:

1. Publish all messages since the last period. After each message, run a round of the node barrier: wait until all nodes
   have processed the message.
2. Publish the time on /clock.
3. Run two rounds, so that nodes receive the time and run their timers. Run more rounds until a command arrives, at most
   one per node.
4. Without a command while the robot drives to a goal, wait for a short wall time.
5. If a Nav2 server moves the robot and its command is overdue, wait for the command, at most `limit_s` of wall time.
   If no command arrives in the next simulated second either, the run ends with an error.

Without a command, the robot keeps its previous command. ROS time is always a multiple of the control period.

**Paced.** The simulation does not wait for the nodes. It runs at a fixed multiple of real time.
"""

import time
from typing import Any, Dict, List, Optional, Sequence, Tuple

from simscen.ros2.graph import Graph, ReceivedMessage
from simscen.ros2.messages import NS_PER_S, read_header, transforms_first
from simscen.ros2.nav2.actions import MotionActions
from simscen.ros2.node_barrier import NodeBarrier
from simscen.ros2.options import AdapterError
from simscen.ros2.readiness import COMMAND, TWIST_STAMPED_TYPE

Message = Tuple[str, bytes]
"""Topic of the stack protocol, and the serialized (CDR) message."""


class LockstepSynchronization:
    """Synchronization in which the simulation waits for the nodes."""

    def __init__(
        self, graph: Graph, barrier: NodeBarrier, actions: MotionActions, rounds: int, wait_s: float, limit_s: float
    ) -> None:
        """Set limits: extra rounds in step 3 (0 = one per node), wall time of step 4, and wall time of step 5."""
        self._graph, self._barrier, self._actions = graph, barrier, actions
        self._extra_rounds, self._wait, self._limit = rounds, wait_s, limit_s
        self.counters: Dict[str, Any] = {"control_periods": 0, "without_command": 0, "late_commands": 0}

    def step(
        self, now: int, messages: Sequence[Message], is_command_due: bool, is_driving: bool
    ) -> List[ReceivedMessage]:
        """Publish `messages`, and return the messages of the nodes since the last step.

        `now` is simulated time in ns. `is_command_due` states whether a control period begins: the robot needs a
        velocity command now. Otherwise, steps 2 to 5 are skipped. `is_driving` states whether the robot drives to a
        goal. Raises AdapterError if a node sends no commands.
        """
        graph, barrier = self._graph, self._barrier
        for topic, data in transforms_first(messages):
            if graph.publish(topic, data):
                barrier.round()
        if not is_command_due:
            return _take_inbox(graph)
        start = len(graph.inbox)
        graph.publish_clock(now)
        for number in range(2 + (self._extra_rounds or len(barrier.nodes))):
            barrier.round()
            if number and _last_command(graph.inbox[start:]) is not None:
                break
        if is_driving:
            graph.spin_until(lambda: _last_command(graph.inbox[start:]) is not None, self._wait)
            self._wait_for_overdue_command(now, start)
        self._count(now, _last_command(graph.inbox[start:]))
        return _take_inbox(graph)

    def _wait_for_overdue_command(self, now: int, start: int) -> None:
        """Perform step 5. `start` is the index of the first message of this period in the inbox."""

        def late_server() -> List[str]:
            overdue = self._actions.overdue_command(now)
            if overdue is None or _last_command(self._graph.inbox[start:]) is not None:
                return []
            return [overdue.node]

        if not self._barrier.step_time.wait_for(late_server, limit_s=self._actions.wait_s(self._limit)):
            overdue = self._actions.record_missing(now)
            if overdue is not None:
                raise AdapterError(
                    f"{overdue.node} sends no commands, although it executes {overdue.action}: none within "
                    f"{self._limit:g} s of wall time, and none in the simulated second after that"
                )

    def _count(self, now: int, command: Optional[ReceivedMessage]) -> None:
        """Update the counters and the tracked actions at the end of a control period."""
        self.counters["control_periods"] += 1
        if command is None:
            self.counters["without_command"] += 1
            return
        self._actions.record_command(now)
        if command.type == TWIST_STAMPED_TYPE and read_header(command.data)[0] < now:
            self.counters["late_commands"] += 1


class PacedSynchronization:
    """Synchronization in which the simulation runs at `factor` times real time, and does not wait for the nodes."""

    def __init__(self, graph: Graph, factor: float) -> None:
        self._graph, self._factor = graph, factor
        self._start: Optional[float] = None
        self.counters: Dict[str, Any] = {"control_periods": 0, "without_command": 0}

    def step(
        self, now: int, messages: Sequence[Message], is_command_due: bool, is_driving: bool
    ) -> List[ReceivedMessage]:
        """Wait until the wall time of the step, publish `messages`, and return the messages of the nodes.

        `now` is simulated time in ns. `is_command_due` states whether a control period begins: the robot needs a
        velocity command now.
        """
        elapsed = now / NS_PER_S / self._factor
        start = time.monotonic() - elapsed
        # After a delay, the rest of the run keeps its pace instead of catching up.
        self._start = start if self._start is None else max(self._start, start)
        due_at = self._start + elapsed
        self._graph.spin_until(lambda: time.monotonic() >= due_at, max(0.0, due_at - time.monotonic()))
        self._graph.publish_clock(now)
        for topic, data in transforms_first(messages):
            self._graph.publish(topic, data)
        self._graph.receive_all()
        if is_command_due:
            self.counters["control_periods"] += 1
            self.counters["without_command"] += _last_command(self._graph.inbox) is None
        return _take_inbox(self._graph)


def _last_command(received: Sequence[ReceivedMessage]) -> Optional[ReceivedMessage]:
    return next((message for message in reversed(received) if message.topic == COMMAND), None)


def _take_inbox(graph: Graph) -> List[ReceivedMessage]:
    """Return all messages of the inbox, and empty the inbox."""
    received, graph.inbox[:] = list(graph.inbox), []
    return received
