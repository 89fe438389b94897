"""Perform one step of a run with the nodes: publish sensor data, advance ROS time, and collect the command.

**Lockstep.** The simulation waits while these steps are performed for a control period:

1. Publish everything measured since the last period, message by message. After each message with a subscriber, run a
   round of the node barrier, because a node may process two waiting messages in any order.
2. Publish the time of the period on /clock.
3. Run at least two rounds. In the first, the nodes receive the new time. After the second, the timers that became due
   have run. Up to one more round per node follows until there is a command, so that it can pass through filter nodes.
4. If there is still no command while the robot drives to a goal, wait for a short wall time, because nodes of rclcpp
   receive /clock in a separate thread.
5. If a Nav2 server executes an action that moves the robot, and its command is due, wait for the command, at most
   `limit_s` of wall time. If it sends no command in the next simulated second either, the run ends with an error.

The command of the period is the last one received. Without one, the robot keeps its previous command, as a real robot
would, and the adapter counts the period. ROS time is always a multiple of the control period.

**Paced.** The simulation does not wait for the nodes: a period begins at its wall time, and the newest command counts.
"""

import time
from typing import Any, Dict, List, Optional, Sequence, Tuple

from simscen.ros2.frames import transforms_first
from simscen.ros2.graph import Graph, ReceivedMessage
from simscen.ros2.messages import NANOSECONDS, read_header
from simscen.ros2.nav2.actions import MotionActions
from simscen.ros2.node_barrier import NodeBarrier
from simscen.ros2.options import AdapterError
from simscen.ros2.readiness import COMMAND, TWIST_STAMPED_TYPE

Message = Tuple[str, bytes]
"""Topic of the protocol, and the message in CDR."""


class LockstepSynchronization:
    """Steps in which the simulation waits for the nodes, as described above."""

    def __init__(
        self, graph: Graph, barrier: NodeBarrier, actions: MotionActions, rounds: int, wait_s: float, limit_s: float
    ) -> None:
        """Limit extra rounds (step 3) to `rounds` (0 = one per node), step 4 to `wait_s`, and step 5 to `limit_s`."""
        self._graph, self._barrier, self._actions = graph, barrier, actions
        self._extra_rounds, self._wait, self._limit = rounds, wait_s, limit_s
        self.counters: Dict[str, Any] = {"beats": 0, "without_command": 0, "late_commands": 0}

    def step(
        self, now: int, messages: Sequence[Message], is_command_due: bool, is_driving: bool
    ) -> List[ReceivedMessage]:
        """Publish `messages`, and return the messages of the nodes since the last step. `now` is in ns.

        Raises AdapterError, with the name of the node, if a command is missing.
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

    def _count(self, now: int, command: Optional[ReceivedMessage]) -> None:
        self.counters["beats"] += 1
        if command is None:
            self.counters["without_command"] += 1
            return
        self._actions.record_command(now)
        if command.type == TWIST_STAMPED_TYPE and read_header(command.data)[0] < now:
            self.counters["late_commands"] += 1


class PacedSynchronization:
    """Steps in which the simulation runs at `factor` times real time, and does not wait for the nodes."""

    def __init__(self, graph: Graph, factor: float) -> None:
        self._graph, self._factor = graph, factor
        self._start: Optional[float] = None
        self.counters: Dict[str, Any] = {"beats": 0, "without_command": 0}

    def step(
        self, now: int, messages: Sequence[Message], is_command_due: bool, is_driving: bool
    ) -> List[ReceivedMessage]:
        """Wait for the wall time of the step, publish `messages`, and return those of the nodes. `now` is in ns."""
        elapsed = now / NANOSECONDS / self._factor
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
            self.counters["beats"] += 1
            self.counters["without_command"] += _last_command(self._graph.inbox) is None
        return _take_inbox(self._graph)


def _last_command(received: Sequence[ReceivedMessage]) -> Optional[ReceivedMessage]:
    return next((message for message in reversed(received) if message.topic == COMMAND), None)


def _take_inbox(graph: Graph) -> List[ReceivedMessage]:
    received, graph.inbox[:] = list(graph.inbox), []
    return received
