"""The stack's side of the protocol: the handshake, then answers to steps until simscen ends the run."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, NamedTuple

from . import messages, wire
from .goals import Goal, Goals
from .wire import Connection, Disconnected, Refused

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

COMMAND, EVENTS, LOG = "/cmd_vel", "/simscen/events", "/rosout"


class Message(NamedTuple):
    """A message on a topic: CDR bytes, and their content."""

    topic: str
    type: str
    raw: bytes

    @property
    def content(self) -> Any:
        """The message as a class of simscen.peer.messages."""
        return messages.read(self.type, self.raw)


class Step:
    """One step: the sensor messages, and the answer, which is sent when the loop continues.

    `messages` are the messages since the last step. `canceled` is true if simscen has canceled a goal since then.
    """

    def __init__(self, peer: Peer, header: wire.StepHeader, received: list[Message], canceled: bool) -> None:
        self._peer, self._header = peer, header
        self.messages = received
        self.canceled = canceled
        self._published: wire.Messages = []
        self._commanded = False

    @property
    def tick(self) -> int:
        """Physics ticks since the start."""
        return self._header.tick

    @property
    def seconds(self) -> float:
        """Simulated time."""
        return self._header.sec + self._header.nanosec * 1e-9

    @property
    def stamp(self) -> messages.Stamp:
        """Simulated time as a ROS stamp."""
        return self._header.sec, self._header.nanosec

    @property
    def command_due(self) -> bool:
        """Whether a command is required."""
        return bool(self._header.flags & wire.COMMAND_DUE)

    def get(self, topic: str) -> Any:
        """Return the content of the newest message on a topic; None if there is none in this step."""
        found = [message for message in self.messages if message.topic == topic]
        return found[-1].content if found else None

    def drive(self, vx: float, wz: float, vy: float = 0.0) -> None:
        """Command a velocity: m/s forward, rad/s counterclockwise, m/s to the left. It holds until the next command."""
        self._peer.command = (float(vx), float(vy), float(wz))
        self._commanded = True

    def publish(self, topic: str, data: bytes) -> None:
        """Publish a message on a topic that simscen accepts; see simscen.peer.messages. Raises KeyError for others."""
        self._published.append((self._peer.accepted_topics[topic], data))

    def log(self, text: str, level: int = 20) -> None:
        """Write a line to /rosout of the run's log; 10 debug, 20 info, 30 warning, 40 error."""
        self.publish(LOG, messages.log(self.stamp, level, self._peer.name, text))

    def _answer(self) -> bytes:
        if self.command_due or self._commanded:
            self.publish(COMMAND, messages.twist(*self._peer.command))
        for event in self._peer.goals.take_events():
            self.publish(EVENTS, messages.string(json.dumps(event, allow_nan=False)))
        return wire.answer_frame(self.tick, self._published)


class Peer:
    """Connection of a stack to simscen. Iterating gives one Step after another until the run ends.

    `topics` are the topics to receive, None = all. With `every_beat` there is a step whenever a sensor publishes;
    otherwise there is one for each command, with the readings since the last step. `modes` are the supported ways to
    take goals, by the names of Nav2's actions; a stack with navigate_through_poses passes goals with `via` without
    stopping. `about` is kept in the run's log.

    Raises wire.Malformed or Refused for protocol errors, Disconnected when simscen closes the connection.
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
        self._canceled = False
        self._bye_content: dict[str, Any] = {}
        self.hello = self._expect(wire.HELLO)
        if wire.PROTOCOL not in self.hello["protocols"]:
            self.give_up(f"{name} requires version {wire.PROTOCOL} of the stack protocol")
        self._topics: dict[int, tuple[str, str]] = {t["number"]: (t["topic"], t["type"]) for t in self.hello["says"]}
        self.accepted_topics: dict[str, int] = {topic["topic"]: topic["number"] for topic in self.hello["hears"]}
        self._connection.send_json(
            wire.WELCOME,
            {
                "protocol": wire.PROTOCOL,
                "name": name,
                "version": version,
                "topics": [topic for topic, _ in self._topics.values()] if topics is None else list(topics),
                "step": "beat" if every_beat else "control",
                "modes": list(modes),
                "about": about or {},
            },
        )

    @property
    def robot(self) -> dict[str, Any]:
        """Properties of the robot, see HELLO in the protocol."""
        robot: dict[str, Any] = self.hello["robot"]
        return robot

    @property
    def robot_name(self) -> str:
        """The robot's name if the scenario has several robots, else ""."""
        name: str = self.hello.get("robot_name", "")
        return name

    def __iter__(self) -> Iterator[Step]:
        """Yield steps until the run ends; each is answered when the next one is requested."""
        while True:
            kind, body = self._connection.receive()
            if kind == wire.STEP:
                header, received = wire.from_step(body)
                self.goals.now = header.sec + header.nanosec * 1e-9
                step = Step(self, header, [self._message(*each) for each in received], self._canceled)
                self._canceled = False
                yield step
                self._connection.send(step._answer())
            elif kind == wire.END:
                self._connection.send_json(wire.BYE, {"about": self._bye_content})
                self._connection.close()
                return
            else:
                self._process_frame(kind, wire.from_json(body))

    def add(self, **about: Any) -> None:
        """Add facts about this stack to the run's log. They are sent at the end of the run."""
        self._bye_content.update(about)

    def give_up(self, message: str) -> None:
        """End the run with this error message. Raises Refused with the same message."""
        self._connection.send_json(wire.ERROR, {"message": message})
        self._connection.close()
        raise Refused(message)

    def _process_frame(self, kind: int, content: dict[str, Any]) -> None:
        if kind == wire.GOAL:
            self.task = content
            self.goals.start([Goal.of(goal) for goal in content["goals"]])
        elif kind == wire.PREEMPT:
            self.goals.preempted(Goal.of(content["goal"]))
        elif kind == wire.CANCEL:
            self._canceled = True
            self.goals.canceled(content["all"])
        else:
            raise wire.Malformed(f"a stack cannot receive a frame of kind {kind}")

    def _message(self, number: int, data: bytes) -> Message:
        return Message(*self._topics[number], data)

    def _expect(self, kind: int) -> dict[str, Any]:
        received_kind, body = self._connection.receive()
        if received_kind != kind:
            raise wire.Malformed(f"a frame of kind {received_kind} instead of {wire.KIND_NAMES[kind]}")
        return wire.from_json(body)


__all__ = ["Connection", "Disconnected", "Goal", "Goals", "Message", "Peer", "Refused", "Step"]
