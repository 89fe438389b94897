"""The stack that simscen talks to: a ROS graph behind the calls of the stack protocol."""

import math
import os
import time
from importlib.metadata import version
from typing import Any, Callable, Dict, List, Optional, Sequence, Tuple

import rclpy

from simscen.peer.goals import Goal, Goals
from simscen.ros2 import cdr, interfaces
from simscen.ros2.beat import CLOCK, Lockstep, Message, Paced
from simscen.ros2.belief import PLAN, Belief
from simscen.ros2.failure import Failure
from simscen.ros2.goals import Door, Doors, Failed, Now
from simscen.ros2.graph import Graph, Heard, Topic
from simscen.ros2.launched import Launched
from simscen.ros2.names import Names
from simscen.ros2.options import Options
from simscen.ros2.readiness import COMMAND, TWIST_STAMPED, Readiness
from simscen.ros2.rest import Rest

HEARD = {
    "/plan": "nav_msgs/msg/Path",
    "/amcl_pose": "geometry_msgs/msg/PoseWithCovarianceStamped",
    "/particle_cloud": "nav2_msgs/msg/ParticleCloud",
    "/tf": "tf2_msgs/msg/TFMessage",
}
"""What is heard of the stack besides its commands."""
THROUGH = "navigate_through_poses"
BASE, INITIAL_POSE = "base_link", "/initialpose"
ZERO = (0.0,) * 6


class Adapter:
    """One run: made with the topics that simscen has, then asked at every step. `mode` is the scenario's."""

    def __init__(self, options: Options, topics: Sequence[Topic], goals: Goals, launched: Optional[Launched]) -> None:
        if not rclpy.ok():
            rclpy.init(args=[])
        self._options, self._goals, self._launched = options, goals, launched
        self._graph = Graph(Names(options.namespace, options.remap), self._watch)
        self._belief = Belief()
        self._doors = Doors(self._graph, options.goals)
        self._rest = Rest(self._graph, time.monotonic, options.answer)
        self._door: Optional[Door] = None
        self._velocity: Tuple[float, ...] = ZERO
        self._ready, self._go_on = False, True
        self.mode, self._sent = "", 0
        self._planned_for: Optional[Goal] = None
        self._unsaid: List[Message] = []
        self.left_out: List[str] = []
        given = [Topic(CLOCK, "rosgraph_msgs/msg/Clock"), *topics]
        for topic in given:
            if topic.name not in options.without and not self._graph.offer(topic.name, topic.type):
                self.left_out.append(f"{topic.name} ({topic.type})")
        given = [topic for topic in given if topic.name in self._graph.offered]
        self._readiness = Readiness(self._graph, self._rest, given, self._doors, options)
        self._lockstep = Lockstep(self._graph, self._rest, time.monotonic, options.rounds, options.wait)
        self._paced = Paced(self._graph, time.monotonic, options.factor)

    @property
    def offered(self) -> Dict[str, Any]:
        """Topic of the protocol → its publisher."""
        return self._graph.offered

    def _watch(self) -> None:
        """Raise Failure when what was launched has ended."""
        if self._launched is not None and self._launched.ended is not None:
            raise Failure(f"what was launched {self._launched.ended}: {self._launched.command}")

    def about(self) -> Dict[str, Any]:
        """What is worth knowing of this run, for its log and run.json."""
        synchronized: Any = self._lockstep if self._options.sync == "lockstep" else self._paced
        about = {
            "sync": self._options.sync,
            "rclpy": version("rclpy"),
            "distribution": os.environ.get("ROS_DISTRO", "unknown"),
            "rmw": rclpy.get_rmw_implementation_identifier(),
            "nodes": self._rest.nodes,
            **synchronized.counted,
        }
        if self._options.sync == "paced":
            about["factor"] = self._options.factor
        if self._rest.silent:
            about["not_in_step"] = self._rest.silent
        if self._door is not None:
            about["goals"] = self._door.name
        if self.left_out:
            about["not_published"] = self.left_out
        return about

    def get_ready(self) -> None:
        """Before the first step: wait until the graph is what a run needs, or at least there if it is to warm up."""
        if self._options.warm_up:
            self._wait_until(self._readiness.nobody)
        else:
            self._wait_until(self._readiness.missing)
            self._begin()

    def start(self, goals: Sequence[Goal], go_on: bool) -> None:
        """The goals of the run; `go_on` with the others when one fails."""
        self._goals.start(goals)
        self._go_on = go_on

    def preempt(self, now: int, goal: Goal) -> None:
        """Another goal comes first."""
        self._goals.preempted(goal)
        self._send(now)

    def cancel(self, now: int, everything: bool) -> None:
        """Drop the current goal, or all."""
        if self._door is not None and self._goals.current is not None:
            self._door.cancel(self._now(now), self._rest)
        self._goals.canceled(everything)

    def step(self, now: int, messages: Sequence[Message], due: bool) -> List[Message]:
        """One step at `now` nanoseconds: what the stack says. Raises Failure when the graph has become unfit."""
        self._watch()
        for topic, data in messages:
            self._belief.given(topic, data)
        messages = [(topic, self._with_base_frame(topic, data)) for topic, data in messages]
        messages = self._with_initial_pose(messages)
        warming_up = now < self._options.warm_up * cdr.NANOSECONDS
        if not warming_up and not self._ready:
            # Who came late has not heard the time yet.
            self._wait_until(self._readiness.missing, lambda: self._graph.publish(CLOCK, cdr.time(now)))
            self._begin()
        synchronized: Any = self._lockstep if self._options.sync == "lockstep" and not warming_up else self._paced
        if not warming_up and self._goals.current is None:
            self._send(now)
        heard = synchronized.beat(now, messages, due, self._goals.current is not None)
        commanded = any(message.topic == COMMAND for message in heard)
        # Topics have an order of their own each; which of two came first is chance.
        said = sorted((out for message in heard for out in self._taken(message)), key=lambda out: out[0])
        if due or commanded:
            said.append((COMMAND, cdr.twist(self._velocity)))
        if self._ready:
            self._settle(now)
        return said

    def _wait_until(self, lacks: Callable[[], List[str]], meanwhile: Callable[[], Any] = lambda: None) -> None:
        missing: List[str] = []
        since, there = time.monotonic(), self._graph.nodes()

        def complete() -> bool:
            """Nothing is missing, and no node has come or gone for a while."""
            nonlocal since, there
            meanwhile()
            missing[:] = lacks()
            if missing or there != self._graph.nodes():
                since, there = time.monotonic(), self._graph.nodes()
            return time.monotonic() - since >= self._options.settle

        if not self._graph.until(complete, self._options.ready, time.monotonic):
            told = "; ".join(missing) or "nodes come and go"
            raise Failure(f"the graph is not ready after {self._options.ready:g} s: {told}")

    def _begin(self) -> None:
        """The graph is what a run needs: hear what it says from now on."""
        self._ready = True
        self._graph.hear(COMMAND, self._readiness.command_type())
        for topic, type_ in HEARD.items():
            if topic == "/tf" or self._graph.publishers(self._graph.names(topic)):
                self._graph.hear(topic, type_)
        self._door = self._doors.door

    def _send(self, now: int) -> None:
        """Send the goals that are left; what is rejected has failed."""
        while self._door is not None and self._goals.accept() is not None:
            assert self._goals.current is not None
            drive = self._drive()
            self._sent = 1 if self._door.one_by_one else len(drive)
            failed = self._door.send(drive, now, self._rest)
            if failed is None:
                return
            self._goals.failed(failed.code, failed.message, go_on=self._go_on)

    def _drive(self) -> List[Goal]:
        """What goes into one action: all goals that are left, or up to where the scenario has the robot stop or wait.

        How long a waypoint follower waits is its own parameter; so it is sent on anew after each wait.
        """
        assert self._goals.current is not None
        left = [self._goals.current, *self._goals.waiting]
        stops = (k for k, goal in enumerate(left) if goal.wait or (self.mode == THROUGH and not goal.via))
        return left[: next(stops, len(left)) + 1]

    def _settle(self, now: int) -> None:
        """Tell what became of the goals."""
        assert self._door is not None
        for outcome in self._door.outcomes(self._now(now)) if self._goals.current is not None else ():
            if self._goals.current is None:
                return
            self._sent -= 1
            if isinstance(outcome, Failed):
                self._sent -= len(self._goals.ahead)
                self._goals.failed(outcome.code, outcome.message, go_on=self._go_on)
            else:
                self._goals.reached()
            if self._sent <= 0:
                return
            self._goals.accept()

    def _now(self, now: int) -> Now:
        still = all(abs(number) < 1e-3 for number in self._velocity)
        return Now(now, still, self._belief.pose)

    def _taken(self, message: Heard) -> List[Message]:
        """A message of the stack as the protocol has it; none for a command, or for what does not concern it."""
        if message.topic == COMMAND:
            self._velocity = cdr.velocity(message.data, message.type == TWIST_STAMPED)
            return []
        concerns = self._belief.heard(message)
        if message.topic == PLAN:
            self._tell_plan()
        return [(message.topic, message.data)] if concerns else []

    def _tell_plan(self) -> None:
        """Every plan is an event. Why it was made, a graph does not say: for a new goal, or because it was time."""
        goal, plan = self._goals.current, self._belief.plan
        if goal is None or not plan:
            return
        length = sum(math.dist(a, b) for a, b in zip(plan, plan[1:]))
        reason = "rate" if self._planned_for is goal else "goal"
        self._planned_for = goal
        self._goals.say("plan.made", goal.name, reason=reason, length=round(length, 6))

    def _with_initial_pose(self, messages: Sequence[Message]) -> List[Message]:
        """/initialpose is said once: not before anybody hears it."""
        self._unsaid += [message for message in messages if message[0] == INITIAL_POSE]
        messages = [message for message in messages if message[0] != INITIAL_POSE]
        if self._unsaid and self._graph.subscribers(self._graph.names(INITIAL_POSE)):
            messages, self._unsaid = [*messages, *self._unsaid], []
        return messages

    def _with_base_frame(self, topic: str, data: bytes) -> bytes:
        """What the topic says; on /tf_static with the robot's base under a second name where nodes call it so."""
        if topic != "/tf_static" or self._options.base_frame in (None, BASE):
            return data
        from rclpy.serialization import deserialize_message, serialize_message

        kind: Any = interfaces.find("tf2_msgs/msg/TFMessage")
        link_kind: Any = interfaces.find("geometry_msgs/msg/TransformStamped")
        if kind is None:
            return data
        message, link = deserialize_message(data, kind), link_kind()
        link.header.frame_id, link.child_frame_id, link.transform.rotation.w = BASE, self._options.base_frame, 1.0
        message.transforms.append(link)
        return bytes(serialize_message(message))

    def end(self) -> None:
        """Leave the graph, and end what was launched."""
        self._graph.close()
        if self._launched is not None:
            self._launched.end()
