"""Main loop of the adapter for one run: performs the handshake with simscen, prepares the nodes, answers all steps."""

import json
import os
import shutil
import signal
import sys
import tempfile
import time
from contextlib import ExitStack
from typing import Any, Dict, List, NamedTuple, Sequence, Tuple

from simscen.peer import messages, wire
from simscen.peer.goals import Goal, Goals
from simscen.peer.wire import Connection, Disconnected
from simscen.ros2.launch import LaunchedCommand
from simscen.ros2.nav2.filter_info import MASK_TOPICS, FilterInfo
from simscen.ros2.nav2.report import ROSOUT
from simscen.ros2.options import AdapterError, BringUpAborted, Options
from simscen.ros2.ros_domain import claim_domain, ros_environment, user_domain

EVENTS = "/simscen/events"
DEFAULT_MODE = "navigate_to_pose"
MODES = (DEFAULT_MODE, "navigate_through_poses", "follow_waypoints")
"""Nav2 actions that a scenario can request for its goals."""
PROTOCOL_TOPICS = {published: topic for topic, published in MASK_TOPICS.items()}
"""Topics of zone masks in the stack protocol, by the topics on which the adapter publishes them."""
READY_MARGIN_S = 15.0
"""Wall time that the first answer may take in addition to `--ready`."""


def main(values: Dict[str, Any]) -> int:
    """Serve one run. `values` are the Options by name. Return 0, or 1 after an error or if simscen has disconnected."""
    connection = Connection.inherited()
    # Exceptions unwind, so that the adapter ends what it started.
    signal.signal(signal.SIGTERM, _terminate)
    try:
        with AdapterRun(Options(**values), connection) as run:
            run.serve()
    except AdapterError as error:
        print(f"simscen ros2: {error}", file=sys.stderr)
        connection.send_json(wire.ERROR, {"message": str(error)})
        return 1
    except Disconnected:
        return 1
    return 0


class Hello(NamedTuple):
    """Content of HELLO, the first frame from simscen."""

    topics: Dict[int, Tuple[str, str]]
    """Names and types of the topics that simscen can send for the robot, by topic number."""
    stack_topics: Dict[str, int]
    """Numbers of the topics that the adapter can send, by name."""
    period_s: float
    """Control period."""
    mode: str
    """Nav2 action that the scenario requests, one of MODES."""
    zone_masks: List[Dict[str, Any]]
    """Descriptions of the zone masks (keys `topic`, `filter`, `percent`, `base`, `multiplier`)."""
    answer_limit_s: float
    """Maximum wall time for an answer after the nodes are ready."""

    @classmethod
    def receive(cls, connection: Connection) -> "Hello":
        """Receive HELLO. Raises AdapterError for another frame or another version of the protocol."""
        kind, body = connection.receive()
        if kind != wire.HELLO:
            raise AdapterError(f"a frame of kind {kind} instead of HELLO")
        hello = wire.from_json(body)
        if wire.PROTOCOL not in hello["protocols"]:
            raise AdapterError(f"simscen ros2 requires version {wire.PROTOCOL} of the stack protocol")
        return cls(
            {
                topic["number"]: (MASK_TOPICS.get(topic["topic"], topic["topic"]), topic["type"])
                for topic in hello["says"]
                if _is_robot_topic(topic)
            },
            {topic["topic"]: topic["number"] for topic in hello["hears"]},
            hello["control_period"] / hello["tick_rate"],
            hello.get("mode", DEFAULT_MODE),
            hello["zone_masks"],
            hello["answer_limit"],
        )


class ReceivedStep(NamedTuple):
    """Content of a STEP frame.

    now:             simulated time in ns
    messages:        topic and serialized (CDR) message
    is_command_due:  whether the robot needs a velocity command now
    limit_s:         maximum wall time for the answer
    """

    now: int
    messages: List[Tuple[str, bytes]]
    is_command_due: bool
    limit_s: float


class AdapterRun:
    """One run of the adapter. Leaving its context ends the adapter and the launch command, and releases the domain."""

    def __init__(self, options: Options, connection: Connection) -> None:
        self._connection, self._hello = connection, Hello.receive(connection)
        self._options = _options_for(options, self._hello.mode)
        self._cleanup = ExitStack()
        self.goals = Goals()
        self._adapter: Any = None
        self._steps_until_ready: List[ReceivedStep] = []

    def __enter__(self) -> "AdapterRun":
        return self

    def __exit__(self, *_: Any) -> None:
        # simscen sends SIGTERM if nodes take long to end. It must not interrupt the code that ends them.
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
        if self._adapter is not None:
            self._adapter.end()
        self._cleanup.close()

    def serve(self) -> None:
        """Answer frames until END. Raises AdapterError, and Disconnected if simscen closes the connection."""
        from simscen.ros2.adapter import require_packages

        if self._options.nav2:
            require_packages(self._options)
        self._set_environment()
        self._start_adapter("")
        facts = self._adapter.run_facts()
        welcome = {
            "protocol": wire.PROTOCOL,
            "name": "simscen ros2",
            "version": facts["rclpy"],
            "step": "control",
            "modes": [*MODES],
            "first_answer_limit": self._options.ready + READY_MARGIN_S,
            "first_answer_until": self._adapter.latest_start_s,
            "topics": [
                PROTOCOL_TOPICS.get(name, name)
                for name, _ in self._hello.topics.values()
                if name in self._adapter.needed_topics
            ],
            "about": facts,
        }
        self._connection.send_json(wire.WELCOME, welcome)
        now = 0
        while True:
            kind, body = self._connection.receive()
            if kind == wire.STEP:
                header, content = wire.from_step(body)
                now = header.sec * 10**9 + header.nanosec
                self.goals.now = now * 1e-9
                published = [(self._hello.topics[number][0], data) for number, data in content]
                is_command_due = bool(header.flags & wire.COMMAND_DUE)
                received = self._step(ReceivedStep(now, published, is_command_due, header.deadline * 1e-3))
                stamp = header.sec, header.nanosec
                received += [(ROSOUT, messages.log(stamp, *line)) for line in self._adapter.take_lines()]
                self._connection.send(wire.answer_frame(header.tick, self._number_messages(received)))
            elif kind == wire.END:
                self._connection.send_json(wire.BYE, {"about": self._adapter.run_facts()})
                return
            else:
                self._process_frame(kind, wire.from_json(body), now)

    def _start_adapter(self, restart_reason: str) -> None:
        """Run the launch command, and create and prepare the adapter. `restart_reason` is empty at the first start."""
        from simscen.ros2.adapter import Adapter
        from simscen.ros2.graph import Topic

        options, hello = self._options, self._hello
        launch_command = LaunchedCommand(options.launch, os.environ) if options.launch else None
        topics = [Topic(*topic) for topic in hello.topics.values()]
        limits, filter_info = (hello.period_s, hello.answer_limit_s), FilterInfo(hello.zone_masks)
        self._adapter = Adapter(options, topics, self.goals, launch_command, *limits, filter_info, restart_reason)
        self._adapter.prepare()

    def _step(self, step: ReceivedStep) -> List[Tuple[str, bytes]]:
        """Perform a step, and return the messages of the nodes. If Nav2 aborts its bring-up, restart Nav2 once.

        After a restart, all earlier steps are repeated.
        """
        # On a busy machine, Nav2's lifecycle manager gives up when a single response is lost.
        if self._adapter.is_ready:
            return list(self._adapter.step(*step))
        end = time.monotonic() + step.limit_s
        try:
            return list(self._adapter.step(*step))
        except BringUpAborted as error:
            if self._adapter.restart_reason:
                raise
            print(f"simscen ros2: {error}; starting the launched command again", file=sys.stderr)
            aborted, self._adapter = self._adapter, None
            aborted.end()
            self._start_adapter(f"{error.manager} had given up the bring-up")
            self._adapter.mode, self._adapter.continue_after_failure = aborted.mode, aborted.continue_after_failure
            for earlier_step in self._steps_until_ready:
                self._adapter.step(*earlier_step)
            return list(self._adapter.step(*step._replace(limit_s=end - time.monotonic())))
        finally:
            self._steps_until_ready.append(step)

    def _process_frame(self, kind: int, content: Dict[str, Any], now: int) -> None:
        """Update the goals by a GOAL, PREEMPT, or CANCEL frame."""
        if kind == wire.GOAL:
            self.goals.start([Goal.from_content(goal) for goal in content["goals"]])
            self._adapter.continue_after_failure = content["on_goal_failure"] == "continue"
            self._adapter.mode = content.get("mode", DEFAULT_MODE)
        elif kind == wire.PREEMPT:
            self._adapter.preempt(now, Goal.from_content(content["goal"]))
        elif kind == wire.CANCEL:
            self._adapter.cancel(now, content["all"])

    def _number_messages(self, received: Sequence[Tuple[str, bytes]]) -> List[Tuple[int, bytes]]:
        """Return the `received` messages and the events of the goals, with topic numbers instead of topics."""
        stack_topics = self._hello.stack_topics
        numbered = [(stack_topics[topic], data) for topic, data in received if topic in stack_topics]
        events = (json.dumps(event, allow_nan=False) for event in self.goals.take_events())
        return numbered + [(stack_topics[EVENTS], messages.string(event)) for event in events]

    def _set_environment(self) -> None:
        """Claim a ROS domain, and set the environment variables of this process and its nodes.

        By default, a launch command gets a free domain, and nodes that the user starts are in the user's domain.
        """
        options, environment = self._options, dict(os.environ)
        requested = options.domain
        if requested is None and not options.launch:
            requested = user_domain(environment)
        domain = claim_domain(requested, environment)
        self._cleanup.callback(domain.release)
        logs = tempfile.mkdtemp(prefix="simscen-ros-logs-")
        self._cleanup.callback(shutil.rmtree, logs, ignore_errors=True)
        os.environ.clear()
        os.environ.update(ros_environment(domain.number, logs, environment))
        os.environ.pop(wire.SOCKET_FD_VARIABLE, None)  # nodes must not use the socket to simscen


def _options_for(options: Options, mode: str) -> Options:
    """Return the options with `mode` as `goals`. Raises AdapterError if `--goals` contradicts the mode."""
    if mode in (DEFAULT_MODE, options.goals):
        return options
    if options.goals != "auto":
        raise AdapterError(f"the scenario sends goals by {mode}, but --goals is {options.goals}")
    return options._replace(goals=mode)


def _is_robot_topic(topic: Dict[str, Any]) -> bool:
    """Return whether a real robot would have this topic, unlike ground truth and simscen's own topics."""
    name: str = topic["topic"]
    if name in MASK_TOPICS.values():  # masks without zones; the adapter uses these names for the masks with zones
        return False
    return not name.startswith(("/simscen", "/ground_truth")) and not name.endswith("/exact") and name != "/clock"


def _terminate(*_: Any) -> None:
    raise Disconnected("terminated by simscen")
