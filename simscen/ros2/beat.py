"""One beat: what the sensors say goes out, time goes on, and the command that belongs to it comes back.

*Lockstep.* A beat at which a command is due goes like this, while simulation waits:

1. All that was measured since the last such beat is published, message by message, with a round of `rest.py` after each
   that anybody hears: of two that come together a node takes whichever it likes first.
2. /clock says the time of the beat.
3. Rounds, two at least: in the first the nodes take the new time, in the second the timers that it made due have run.
   As long as no command has come, one more for each node: so far may a command have to go through filters.
4. Where a goal is driven to and still none has come, a short while of wall time, for nodes that take /clock in a thread
   of its own, as rclcpp's do.

The command of the beat is the last one that has come by then. When none has come, the robot keeps the one it has, as
a robot would; the run counts such beats. Time stands still within a control period: /clock says multiples of it only.

*Paced.* Nothing waits for the stack: the beat begins when wall time has come so far, and the newest command counts.
"""

from typing import Any, Callable, Dict, List, Optional, Sequence, Tuple

from simscen.ros2 import cdr
from simscen.ros2.graph import Graph, Heard
from simscen.ros2.readiness import COMMAND, TWIST_STAMPED
from simscen.ros2.rest import Rest

Message = Tuple[str, bytes]
CLOCK = "/clock"


class Lockstep:
    """Simulation waits for the stack."""

    def __init__(self, graph: Graph, rest: Rest, clock: Callable[[], float], rounds: int, wait: float) -> None:
        self._graph, self._rest, self._clock = graph, rest, clock
        self._extra, self._wait = rounds, wait
        self.counted: Dict[str, Any] = {"beats": 0, "without_command": 0, "late_commands": 0}

    def beat(self, now: int, messages: Sequence[Message], due: bool, driving: bool) -> List[Heard]:
        """The messages of the stack since the last beat; `now` in nanoseconds, `driving` to a goal."""
        graph, rest = self._graph, self._rest
        for topic, data in messages:
            if graph.publish(topic, data):
                rest.round()
        if not due:
            return _taken(graph)
        early = len(graph.inbox)
        graph.publish(CLOCK, cdr.time(now))
        for number in range(2 + (self._extra or len(rest.nodes))):
            rest.round()
            if number and _command(graph.inbox[early:]) is not None:
                break
        if driving:
            graph.until(lambda: _command(graph.inbox[early:]) is not None, self._wait, self._clock)
        self._count(now, _command(graph.inbox[early:]))
        return _taken(graph)

    def _count(self, now: int, command: Optional[Heard]) -> None:
        self.counted["beats"] += 1
        if command is None:
            self.counted["without_command"] += 1
        elif command.type == TWIST_STAMPED and cdr.header(command.data)[0] < now:
            self.counted["late_commands"] += 1


class Paced:
    """The stack lives at `factor` times real time; who is late is late."""

    def __init__(self, graph: Graph, clock: Callable[[], float], factor: float) -> None:
        self._graph, self._clock, self._factor = graph, clock, factor
        self._start: Optional[float] = None
        self.counted: Dict[str, Any] = {"beats": 0, "without_command": 0}

    def beat(self, now: int, messages: Sequence[Message], due: bool, driving: bool) -> List[Heard]:
        """The messages of the stack since the last beat; `now` in nanoseconds."""
        begun = self._clock() - now / cdr.NANOSECONDS / self._factor
        # Who fell behind does not run after: the rest of the run keeps its pace.
        self._start = begun if self._start is None else max(self._start, begun)
        ahead = self._start + now / cdr.NANOSECONDS / self._factor
        self._graph.until(lambda: self._clock() >= ahead, max(0.0, ahead - self._clock()), self._clock)
        self._graph.publish(CLOCK, cdr.time(now))
        for topic, data in messages:
            self._graph.publish(topic, data)
        self._graph.take_all()
        if due:
            self.counted["beats"] += 1
            self.counted["without_command"] += _command(self._graph.inbox) is None
        return _taken(self._graph)


def _command(heard: Sequence[Heard]) -> Optional[Heard]:
    return next((message for message in reversed(heard) if message.topic == COMMAND), None)


def _taken(graph: Graph) -> List[Heard]:
    taken, graph.inbox[:] = list(graph.inbox), []
    return taken
