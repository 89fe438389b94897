"""The adapter's side of the stack protocol: hello, get the graph ready, answer steps until the run ends."""

import os
import shutil
import signal
import sys
import tempfile
from typing import Any, Callable, Dict, List, Optional, Sequence, Tuple

from simscen.peer import wire
from simscen.peer.connection import Connection, Gone
from simscen.peer.goals import Goal, Goals
from simscen.ros2.domain import Domain, claim, surroundings
from simscen.ros2.failure import Failure
from simscen.ros2.launched import Launched
from simscen.ros2.options import Options

EVENTS = "/simscen/events"
DEFAULT_MODE = "navigate_to_pose"
MODES = (DEFAULT_MODE, "navigate_through_poses", "follow_waypoints")


def main(values: Dict[str, Any]) -> int:
    """Serve one run. Exit code 0; 1 when it ended in an error, which simscen was told."""
    connection = Connection.inherited()
    # What is told to end must end what it has started.
    signal.signal(signal.SIGTERM, _leave)
    try:
        with Run(Options(**values)) as run:
            run.serve(connection)
    except Failure as failure:
        print(f"simscen ros2: {failure}", file=sys.stderr)
        connection.send_json(wire.ERROR, {"message": str(failure)})
        return 1
    except Gone:
        return 1
    return 0


class Run:
    """A domain, its nodes and the adapter between them and simscen; left behind as it was found."""

    def __init__(self, options: Options) -> None:
        self._options = options
        self._ends: List[Callable[[], None]] = []
        self.goals = Goals()

    def __enter__(self) -> "Run":
        return self

    def __exit__(self, *_: Any) -> None:
        for end in reversed(self._ends):
            end()

    def serve(self, connection: Connection) -> None:
        """From HELLO to END. Raises Failure, and Gone when simscen hangs up."""
        from simscen.ros2.adapter import Adapter
        from simscen.ros2.graph import Topic

        kind, body = connection.receive()
        if kind != wire.HELLO:
            raise Failure(f"a frame of kind {kind} where HELLO was to come")
        hello = wire.from_json(body)
        if wire.PROTOCOL not in hello["protocols"]:
            raise Failure(f"simscen ros2 speaks version {wire.PROTOCOL} of the stack protocol")
        launched = self._prepare()
        said = {one["number"]: Topic(one["topic"], one["type"]) for one in hello["says"] if _in_the_graph(one)}
        options = self._with_action_of(hello.get("mode", DEFAULT_MODE))
        if options.warm_up:  # what is missing then must be said before simscen gives up the answer to that step
            options = options._replace(ready=min(options.ready, 0.8 * hello["answer_limit"]))
        adapter = Adapter(options, list(said.values()), self.goals, launched)
        self._ends.append(adapter.end)
        adapter.get_ready()
        about = adapter.about()
        welcome = {
            "protocol": wire.PROTOCOL,
            "name": "simscen ros2",
            "version": about["rclpy"],
            "step": "control",
            "modes": [*MODES],
        }
        topics = [topic.name for topic in said.values() if topic.name in adapter.offered]
        connection.send_json(wire.WELCOME, {**welcome, "topics": topics, "about": about})
        hears = {one["topic"]: one["number"] for one in hello["hears"]}
        self._answer_all(connection, adapter, said, hears)

    def _answer_all(self, connection: Connection, adapter: Any, said: Dict[int, Any], hears: Dict[str, int]) -> None:
        now = 0
        while True:
            kind, body = connection.receive()
            if kind == wire.STEP:
                header, messages = wire.from_step(body)
                now = header.sec * 10**9 + header.nanosec
                self.goals.now = now * 1e-9
                due = bool(header.flags & wire.COMMAND_DUE)
                heard = adapter.step(now, [(said[number].name, data) for number, data in messages], due)
                connection.send(wire.answer_frame(header.tick, self._numbered(heard, hears)))
            elif kind == wire.END:
                connection.send_json(wire.BYE, {"about": adapter.about()})
                return
            else:
                self._take(kind, wire.from_json(body), adapter, now)

    def _with_action_of(self, mode: str) -> Options:
        """The options with the action of the scenario's mode; Failure where `--goals` says another one."""
        wanted = self._options.goals
        if mode in (DEFAULT_MODE, wanted):
            return self._options
        if wanted != "auto":
            raise Failure(f"the scenario sends goals by {mode}, and --goals says {wanted}")
        return self._options._replace(goals=mode)

    def _take(self, kind: int, content: Dict[str, Any], adapter: Any, now: int) -> None:
        if kind == wire.GOAL:
            adapter.start([Goal.of(goal) for goal in content["goals"]], content["on_goal_failure"] == "continue")
            adapter.mode = content.get("mode", DEFAULT_MODE)
        elif kind == wire.PREEMPT:
            adapter.preempt(now, Goal.of(content["goal"]))
        elif kind == wire.CANCEL:
            adapter.cancel(now, content["all"])

    def _numbered(self, heard: Sequence[Tuple[str, bytes]], hears: Dict[str, int]) -> "List[Tuple[int, bytes]]":
        """What the stack says as the protocol has it, and what became of its goals."""
        from simscen.peer import messages

        out = [(hears[topic], data) for topic, data in heard if topic in hears]
        return out + [(hears[EVENTS], messages.string(_json(event))) for event in self.goals.take()]

    def _prepare(self) -> Optional[Launched]:
        """Claim a domain, set the environment of all that is ROS here, and start the user's nodes."""
        options, environment = self._options, dict(os.environ)
        domain = self._domain(options, environment)
        self._ends.append(domain.release)
        logs = tempfile.mkdtemp(prefix="simscen-ros-logs-")
        self._ends.append(lambda: shutil.rmtree(logs, ignore_errors=True))
        os.environ.clear()
        os.environ.update(surroundings(domain.number, logs, environment))
        # Nodes need not know of the socket to simscen.
        os.environ.pop(wire.DESCRIPTOR, None)
        return Launched(options.launch, os.environ) if options.launch else None

    @staticmethod
    def _domain(options: Options, environment: Dict[str, str]) -> Domain:
        """One of its own for nodes that are started for this run; else the one that the user's nodes are in."""
        if options.domain is not None or options.launch:
            return claim(options.domain, environment)
        return claim(int(environment.get("ROS_DOMAIN_ID") or 0), environment)


def _in_the_graph(topic: Dict[str, Any]) -> bool:
    """Whether a topic that simscen has belongs to a robot: not the truth, nor what only the protocol knows."""
    name: str = topic["topic"]
    return not name.startswith(("/simscen", "/ground_truth")) and not topic.get("exact", False) and name != "/clock"


def _json(event: Dict[str, Any]) -> str:
    import json

    return json.dumps(event, allow_nan=False)


def _leave(*_: Any) -> None:
    raise Gone("told to end")
