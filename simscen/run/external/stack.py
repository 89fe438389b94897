"""Stack in another process: implements the protocol Stack by exchanging frames over a socket."""

from pathlib import Path as FilePath
from typing import Any

from simscen.core.clock import Clock
from simscen.core.environment.costmap_filters import Filter, Zones
from simscen.core.external_command import ExternalCommand
from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import STOP
from simscen.core.messages.goals import Goal
from simscen.core.messages.navigation import Estimate, Path
from simscen.core.messages.sensor_data import Odometry, Readings
from simscen.core.records.events import EventKind
from simscen.core.records.trace import Decision
from simscen.peer import wire
from simscen.record import topics
from simscen.record.topics import Topic
from simscen.run.external import protocol
from simscen.run.external.answer_decoder import Answer, decode_answer, group_by_topic
from simscen.run.external.goal_tracker import GoalTracker
from simscen.run.external.handshake import RunParameters, goal_content, goal_data, hello_content
from simscen.run.external.protocol import KEEPOUT_MASK, KEEPOUT_ZONES, SPEED_MASK, SPEED_ZONES, ProtocolViolation
from simscen.run.external.publisher import StepPublisher
from simscen.run.external.stack_process import StackProcess
from simscen.run.external.welcome import Welcome
from simscen.run.external.zone_masks import ZoneMasks
from simscen.stack.protocols import Surroundings

END_GRACE_S = 2.0
"""Wall time that a stack may take to disconnect after the frame END."""
_GOAL_ENDS = (EventKind.GOAL_REACHED, EventKind.GOAL_FAILED, EventKind.GOAL_CANCELED)


class ExternalStack:
    """A stack in another process.

    Order of calls: `begin` (start the process), `start` (handshake), `decide` at each beat (tick at which a sensor, the
    stack, or a truth sample is due), `end` (send END), `finish` (wait until the stack disconnects), and `close`.
    `release` and `close` also end the process after an error. `start` and `decide` raise RunError of a kind in
    simscen.run.external.protocol.
    """

    def __init__(
        self,
        name: str,
        command: ExternalCommand,
        surroundings: Surroundings,
        parameters: RunParameters,
        log_file: FilePath | None,
    ) -> None:
        """`name` is for error messages. The output of `command` goes to `log_file` (None: no file)."""
        self._name, self._command, self._log_file = name, command, log_file
        self._surroundings, self._parameters = surroundings, parameters
        self._time = Clock(surroundings.tick_rate)
        self._goals = GoalTracker(parameters.stop_on_failure, surroundings.tick_rate, parameters.mode)
        self._publisher = StepPublisher(surroundings.tick_rate, parameters.sensors, parameters.mounts)
        self._zone_masks = ZoneMasks(surroundings, parameters.switchable_zones)
        self._process: StackProcess | None = None
        self._available_topics: dict[str, Topic] = {}
        self._welcome = Welcome()
        self._plan: Path | None = None
        self._decision = Decision(STOP)
        self._awaits_first_answer = True
        self._has_request, self._is_canceling = False, False
        self._map_from_odom: Pose2 | None = None
        self._odometry: Odometry | None = None
        self._wheel_odometry = next(
            (name for name, kind in parameters.sensors.items() if kind == Odometry.__name__), ""
        )

    def begin(self, estimate: Estimate) -> None:
        """Start the process and send HELLO. `estimate` is the initial pose estimate."""
        surroundings, publisher = self._surroundings, self._publisher
        publisher.latch(surroundings.map, topics.MAP)
        publisher.latch(surroundings.masks.keepout, KEEPOUT_MASK)
        speed = surroundings.masks.speed
        publisher.latch(None if speed is None else speed.grid, SPEED_MASK)
        for topic, mask in self._zone_masks.changed_masks(
            Zones(surroundings.keepout, surroundings.speed_zones, surroundings.masks)
        ):
            publisher.latch(mask, topic)
        publisher.latch_robot(self._parameters.robot_description, estimate)
        self._available_topics = publisher.available_topics()
        self._process = StackProcess(self._name, self._command, self._log_file, self._parameters.robot_name)
        hello = hello_content(
            surroundings,
            self._parameters,
            self._available_topics,
            publisher.sensor_topics,
            self._zone_masks.meanings,
            self._command.answer_limit,
        )
        self._send(wire.HELLO, hello)

    def start(self, estimate: Estimate, goals: tuple[Goal, ...]) -> None:
        """Receive WELCOME, and send GOAL with all goals."""
        assert self._process is not None
        kind, body = self._process.exchange(b"", self._command.start_limit, "answer to HELLO")
        try:
            self._welcome = Welcome.parse(kind, body, self._available_topics, self._parameters.mode)
        except (ProtocolViolation, wire.Malformed) as error:
            raise self._process.error(protocol.PROTOCOL, f"the answer to HELLO: {error}") from error
        self._publisher.set_subscriptions(self._available_topics, self._welcome.topics)
        self._send(wire.GOAL, goal_content(estimate, goals, self._parameters))
        self._goals.start(goals)

    def preempt(self, tick: int, goal: Goal) -> None:
        """Replace the current goal by `goal`. The stack answers at the next call of `decide`."""
        self._goals.preempt(tick, goal)
        self._send_request(wire.PREEMPT, {"tick": tick, "goal": goal_data(goal)})

    def cancel(self, tick: int) -> None:
        """Cancel the current goal and all following goals. The stack answers at the next call of `decide`."""
        self._is_canceling = True
        self._send_request(wire.CANCEL, {"tick": tick, "all": True, "reason": "canceled"})

    def receives_zones_of(self, costmap_filter: Filter) -> bool:
        """Return whether the stack has subscribed to the zone mask of this costmap filter."""
        topic = KEEPOUT_ZONES if costmap_filter == "keepout" else SPEED_ZONES
        return topic.name in self._welcome.topics

    def set_zones(self, tick: int, zones: Zones) -> None:
        """Send the masks that change with the enabled `zones`, together with the next step."""
        for topic, mask in self._zone_masks.changed_masks(zones):
            self._publisher.publish_grid(tick, mask, topic)

    @property
    def plan(self) -> Path | None:
        """Last plan that the stack has sent; None if it follows no plan."""
        return self._plan

    @property
    def goal(self) -> Goal | None:
        """Current goal as reported by the stack; None if there is none, and after `cancel`."""
        return None if self._is_canceling else self._goals.goal

    @property
    def facts(self) -> dict[str, str]:
        """Facts about the stack for the log."""
        return {"external": self._name, **self._welcome.facts}

    @property
    def description(self) -> dict[str, Any]:
        """Facts about the stack for stack.json."""
        return {**self.facts, "about": self._welcome.about}

    def decide(self, tick: int, readings: Readings) -> Decision:
        """Send the readings and return the stack's decision.

        If no command is due, returns the last command, and sends the readings later; except after `preempt` and
        `cancel`, and for a stack with `every_beat`, which decides at each beat with messages.
        """
        self._publisher.publish_readings(tick, readings)
        self._odometry = next(
            (r for r in readings if isinstance(r, Odometry) and r.sensor == self._wheel_odometry), self._odometry
        )
        is_command_due = tick % self._parameters.control_period == 0
        if not (is_command_due or self._has_request or (self._welcome.every_beat and self._publisher.has_messages)):
            return self._decision
        answer = self._request_answer(tick, is_command_due)
        self._has_request = self._is_canceling = False
        return self._to_decision(tick, answer, is_command_due)

    def end(self, reason: str) -> None:
        """Send END to the stack."""
        assert self._process is not None
        self._process.send_end(wire.json_frame(wire.END, {"reason": reason}))

    def finish(self) -> None:
        """Wait until the stack disconnects, for at most END_GRACE_S after `end`, and keep the `about` of its BYE."""
        assert self._process is not None
        self._welcome = self._welcome.with_bye(self._process.receive_bye(END_GRACE_S))

    def release(self) -> None:
        """Request the end of the process, without waiting for it."""
        if self._process is not None:
            self._process.release()

    def close(self) -> None:
        """End the process and its descendants."""
        if self._process is not None:
            self._process.close()
            self._process = None

    def _request_answer(self, tick: int, is_command_due: bool) -> Answer:
        """Send a step and return the answer. `is_command_due` states whether a command is due."""
        assert self._process is not None
        limit = self._command.answer_limit
        if self._awaits_first_answer or tick <= self._welcome.first_answer_until * self._time.rate:
            limit, self._awaits_first_answer = max(limit, self._welcome.first_answer_limit), False
        sec, nanosec = self._time.stamp(tick)
        flags = wire.COMMAND_DUE if is_command_due else 0
        header = wire.StepHeader(tick, sec, nanosec, round(limit * 1e3), flags)
        when = f"the step of t = {tick / self._time.rate:.3f} s"
        kind, body = self._process.exchange(
            wire.step_frame(header, self._publisher.drain()), limit, f"answer to {when} (tick {tick})"
        )
        try:
            return self._decode_answer_frame(kind, body, tick, is_command_due)
        except (ProtocolViolation, wire.Malformed) as error:
            raise self._process.error(protocol.PROTOCOL, f"the answer to {when}: {error}") from error

    def _decode_answer_frame(self, kind: int, body: bytes, tick: int, is_command_due: bool) -> Answer:
        if kind != wire.ANSWER:
            name = wire.KIND_NAMES[kind] if 0 < kind < len(wire.KIND_NAMES) else f"of kind {kind}"
            raise ProtocolViolation(f"a frame {name} instead of an ANSWER")
        answered_tick, messages = wire.from_answer(body)
        if answered_tick != tick:
            raise ProtocolViolation(f"it answers tick {answered_tick} instead of {tick}")
        odometry_pose = None if self._odometry is None else self._odometry.pose
        answer = decode_answer(group_by_topic(messages), tick, self._time, self._map_from_odom, odometry_pose)
        self._map_from_odom = answer.map_from_odom
        if is_command_due and answer.command is None:
            raise ProtocolViolation(f"no message on {topics.COMMAND.name}, though a command is due")
        for event in answer.events:
            self._goals.process(tick, event)
        return answer

    def _to_decision(self, tick: int, answer: Answer, is_command_due: bool) -> Decision:
        self._goals.advance(tick)
        if is_command_due and self._goals.fail_if_timed_out(tick):
            self._send(wire.CANCEL, {"tick": tick, "all": self._parameters.stop_on_failure, "reason": "timeout"})
        events = self._goals.take_events()
        if any(event.kind in _GOAL_ENDS for event in events):
            self._plan = None
        if answer.plan is not None:
            self._plan = answer.plan if len(answer.plan.points) else None
        command = answer.command if answer.command is not None else self._decision.command
        self._decision = Decision(command)
        new_plan = answer.plan if answer.plan is not None and len(answer.plan.points) else None
        return Decision(
            command, answer.belief, new_plan, answer.local_plan, events, answer.lines, answer.costmaps, answer.odometry
        )

    def _send_request(self, kind: int, content: dict[str, Any]) -> None:
        """Send a request, and let the stack decide at the next call of `decide`."""
        self._has_request, self._plan = True, None
        self._send(kind, content)

    def _send(self, kind: int, content: dict[str, Any]) -> None:
        assert self._process is not None
        self._process.send(wire.json_frame(kind, content))
