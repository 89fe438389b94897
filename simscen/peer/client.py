"""Client for a stack in Python: connects to simscen, yields the steps of a run, and sends the stack's answers."""

from __future__ import annotations

import json
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, NamedTuple

from . import messages, wire
from .goals import Goal, Goals
from .wire import Connection, Refused

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

COMMAND, EVENTS, LOG = "/cmd_vel", "/simscen/events", "/rosout"
"""Topics of the velocity command, of events about goals, and of log lines."""


class Message(NamedTuple):
    """A message on a topic, with its ROS type and its serialized bytes (CDR)."""

    topic: str
    type: str
    raw: bytes

    @property
    def content(self) -> Any:
        """The deserialized message: an object of simscen.peer.messages, or a plain Python value."""
        return messages.read(self.type, self.raw)


class Step:
    """One step of the run: the messages for the stack, and the stack's answer.

    `drive`, `publish`, and `log` add to the answer, which is sent when the loop over the Peer requests the next step.

    Attributes:
        messages: Messages since the previous step.
        canceled: True if simscen has sent CANCEL since the previous step, even if there is no current goal.
    """

    def __init__(self, peer: Peer, header: wire.StepHeader, received: list[Message], canceled: bool) -> None:
        self._peer, self._header = peer, header
        self.messages = received
        self.canceled = canceled
        self._published: wire.Messages = []
        self._has_command = False

    @property
    def tick(self) -> int:
        """Number of physics ticks since the start of the run."""
        return self._header.tick

    @property
    def seconds(self) -> float:
        """Simulated time in seconds."""
        return self._header.sec + self._header.nanosec * 1e-9

    @property
    def stamp(self) -> messages.Stamp:
        """Simulated time as a ROS stamp: seconds and nanoseconds."""
        return self._header.sec, self._header.nanosec

    @property
    def command_due(self) -> bool:
        """True if the answer must contain a command. If `drive` is not called, the previous command is repeated."""
        return bool(self._header.flags & wire.COMMAND_DUE)

    def get(self, topic: str) -> Any:
        """Return the content of the newest message on a topic; None if the step has no message on the topic."""
        on_topic = [message for message in self.messages if message.topic == topic]
        return on_topic[-1].content if on_topic else None

    def drive(self, vx: float, wz: float, vy: float = 0.0) -> None:
        """Command `vx` m/s forward, `wz` rad/s counterclockwise, and `vy` m/s to the left, until the next command."""
        self._peer.command = (float(vx), float(vy), float(wz))
        self._has_command = True

    def publish(self, topic: str, data: bytes) -> None:
        """Publish a serialized message. Raises KeyError if simscen does not accept the topic."""
        self._published.append((self._peer.accepted_topics[topic], data))

    def log(self, text: str, level: int = 20) -> None:
        """Write a line to /rosout of the run's log. `level` is 10 debug, 20 info, 30 warning, or 40 error."""
        self.publish(LOG, messages.log(self.stamp, level, self._peer.name, text))

    def _answer(self) -> bytes:
        """Return the ANSWER frame: command, published messages, and events about goals."""
        if self.command_due or self._has_command:
            self.publish(COMMAND, messages.twist(*self._peer.command))
        for event in self._peer.goals.take_events():
            self.publish(EVENTS, messages.string(json.dumps(event, allow_nan=False)))
        return wire.answer_frame(self.tick, self._published)


class Peer:
    """Connection of a stack to simscen. Iteration yields one Step after another until the run ends.

    Args:
        name, version, about: Description of the stack for the run's log. `about` is any JSON object.
        topics: Topics to receive; None for all.
        every_beat: True for additional steps whenever a sensor publishes; False for one step per velocity command.
        modes: Nav2 actions that the stack supports.
        connection: None for the socket that simscen passes to the processes that it starts.

    Attributes:
        hello: Content of the frame HELLO.
        task: Content of the last frame GOAL; {} before the first GOAL.
        goals: Queue of goals.
        command: Last commanded velocity vx, vy, wz.
        accepted_topics: Numbers of the topics that simscen accepts, by name.

    Raises wire.Malformed if a frame is invalid, Refused if simscen reports an error of this stack, and Disconnected if
    simscen closes the connection.
    """

    def __init__(
        self,
        name: str,
        version: str = "",
        topics: Sequence[str] | None = (),
        *,
        every_beat: bool = False,
        modes: Sequence[str] = ("navigate_to_pose",),
        about: dict[str, Any] | None = None,
        connection: Connection | None = None,
    ) -> None:
        self.name = name
        self.goals = Goals()
        self.command: tuple[float, float, float] = (0.0, 0.0, 0.0)
        self._connection = connection or Connection.inherited()
        self.task: dict[str, Any] = {}
        self._canceled = False
        self._bye_content: dict[str, Any] = {}
        kind, body = self._connection.receive()
        if kind != wire.HELLO:
            raise wire.Malformed(f"a frame of kind {kind} instead of HELLO")
        self.hello = wire.from_json(body)
        with _valid_content(kind):
            if wire.PROTOCOL not in self.hello["protocols"]:
                self.give_up(f"{name} requires version {wire.PROTOCOL} of the stack protocol")
            self._received_topics: dict[int, tuple[str, str]] = {
                topic["number"]: (topic["topic"], topic["type"]) for topic in self.hello["says"]
            }
            self.accepted_topics: dict[str, int] = {topic["topic"]: topic["number"] for topic in self.hello["hears"]}
        self._connection.send_json(
            wire.WELCOME,
            {
                "protocol": wire.PROTOCOL,
                "name": name,
                "version": version,
                "topics": [name for name, _ in self._received_topics.values()] if topics is None else list(topics),
                "step": "beat" if every_beat else "control",
                "modes": list(modes),
                "about": about or {},
            },
        )

    @property
    def robot(self) -> dict[str, Any]:
        """Properties of the robot, as in the object `robot` of the frame HELLO."""
        robot: dict[str, Any] = self.hello["robot"]
        return robot

    @property
    def robot_name(self) -> str:
        """The name of the robot if the scenario has several robots, otherwise ""."""
        name: str = self.hello.get("robot_name", "")
        return name

    def __iter__(self) -> Iterator[Step]:
        """Yield steps until the run ends. The answer to a step is sent when the next step is requested.

        Do not leave the loop before the run ends, because simscen would wait for the answer to the last step.
        """
        while True:
            kind, body = self._connection.receive()
            if kind == wire.STEP:
                header, received = wire.from_step(body)
                self.goals.now = header.sec + header.nanosec * 1e-9
                with _valid_content(kind):
                    messages_for_stack = [Message(*self._received_topics[number], data) for number, data in received]
                step = Step(self, header, messages_for_stack, self._canceled)
                self._canceled = False
                yield step
                self._connection.send(step._answer())
            elif kind == wire.END:
                self._connection.send_json(wire.BYE, {"about": self._bye_content})
                self._connection.close()
                return
            else:
                content = wire.from_json(body)
                with _valid_content(kind):
                    self._process_frame(kind, content)

    def add(self, **about: Any) -> None:
        """Add facts about the stack, as JSON values, to the run's log. The facts are sent at the end of the run."""
        self._bye_content.update(about)

    def give_up(self, message: str) -> None:
        """End the run with an error message. Always raises Refused with the same message."""
        self._connection.send_json(wire.ERROR, {"message": message})
        self._connection.close()
        raise Refused(message)

    def _process_frame(self, kind: int, content: dict[str, Any]) -> None:
        """Update the goals by a GOAL, PREEMPT, or CANCEL frame."""
        if kind == wire.GOAL:
            self.task = content
            self.goals.start([Goal.from_content(goal) for goal in content["goals"]])
        elif kind == wire.PREEMPT:
            self.goals.preempt(Goal.from_content(content["goal"]))
        elif kind == wire.CANCEL:
            self._canceled = True
            self.goals.cancel(content["all"])
        else:
            raise wire.Malformed(f"a stack cannot receive a frame of kind {kind}")


@contextmanager
def _valid_content(kind: int) -> Iterator[None]:
    """Context manager that converts errors about missing or invalid fields of a frame to wire.Malformed."""
    try:
        yield
    except (KeyError, TypeError) as error:
        raise wire.Malformed(f"invalid content of {wire.KIND_NAMES[kind]}: {type(error).__name__}: {error}") from error
