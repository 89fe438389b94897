"""Bring-up before a run: waits until all nodes are ready, and publishes the sensor data that nodes need to get ready.

Some nodes become active only if sensor data arrive and time advances. For example, Nav2's costmaps wait for
odom -> base_link. `BringUp.prepare` first waits without sensor data. Then, if nodes are not ready, `BringUp.wait`
publishes the latest readings repeatedly. During this wait, ROS time advances, but simulated time does not.
"""

import math
import sys
import time
from typing import Callable, Dict, List, Optional, Sequence

from rclpy.clock import Clock, ClockType

from simscen.ros2.graph import LATCHED_TOPICS, Graph, Topic
from simscen.ros2.messages import NS_PER_S, SCAN_TYPE
from simscen.ros2.nav2.report import Nav2Report
from simscen.ros2.options import AdapterError, BringUpAborted, Options
from simscen.ros2.readiness import MAP, Readiness
from simscen.ros2.synchronization import Message

INITIAL_POSE = "/initialpose"
MAX_PREPARE_S = 10.0
"""Maximum wall time to wait without sensor data."""
PREPARE_SETTLE_S = 2.0
"""Wall time in addition to `--settle`. If no node appears or disappears for this sum, nodes probably need sensor data.

Not used with Nav2 or `--warm-up`.
"""
CHECK_PERIOD_S = 0.25
"""Wall time between two checks of the graph."""
MAX_FIRST_SCAN_S = 2.0
"""Maximum simulated time until the first scan of each lidar."""


class BringUp:
    """Waits until the nodes of a run are ready, and publishes the latest readings meanwhile."""

    def __init__(
        self,
        graph: Graph,
        readiness: Readiness,
        options: Options,
        period_s: float,
        unavailable: Sequence[Topic],
        report: Optional[Nav2Report],
    ) -> None:
        """`unavailable` are the topics whose message type is not installed; `report` is None without Nav2."""
        self._graph, self._readiness, self._options, self._period = graph, readiness, options, period_s
        self._unavailable, self._report = list(unavailable), report
        self._started_at = time.monotonic()
        self._latest: Dict[str, bytes] = {}
        self._initial_pose: Optional[bytes] = None

    @property
    def latest_start_s(self) -> float:
        """Simulated time in s at which the nodes must be ready."""
        return max(self._options.warm_up, MAX_FIRST_SCAN_S if self._options.nav2 else 0.0) + self._period

    def prepare(self) -> bool:
        """Wait without sensor data. Return whether all nodes are ready; always False with `--warm-up`.

        Raises AdapterError if the launch command ends, or a node needs a topic that cannot be published.
        """
        changed_at = incomplete_at = time.monotonic()
        nodes = self._graph.nodes()
        settle = self._options.settle
        # Wall time without changes after which nodes that are not ready probably need sensor data.
        incomplete_settle = settle if self._options.nav2 or self._options.warm_up else settle + PREPARE_SETTLE_S
        missing: List[str] = []

        def has_settled() -> bool:
            nonlocal changed_at, incomplete_at, nodes
            missing[:] = self._readiness.empty_graph() if self._options.warm_up else self._readiness.problems()
            self._check_unavailable()
            now = time.monotonic()
            if nodes != self._graph.nodes():
                changed_at, nodes = now, self._graph.nodes()
            if missing:
                incomplete_at = now
                return bool(nodes) and now - changed_at >= incomplete_settle
            return now - max(changed_at, incomplete_at) >= settle

        is_settled = self._graph.spin_until(_throttled(has_settled), min(self._options.ready, MAX_PREPARE_S))
        return is_settled and not missing and not self._options.warm_up

    def remember_latest(self, messages: Sequence[Message]) -> None:
        """Remember the latest message of each topic for `wait`."""
        self._latest.update(messages)

    def hold_initial_pose(self, messages: Sequence[Message]) -> List[Message]:
        """Hold back the initial pose until a node subscribes to it. Return the other messages."""
        self._initial_pose = dict(messages).get(INITIAL_POSE, self._initial_pose)
        return [message for message in messages if message[0] != INITIAL_POSE]

    def due_initial_pose(self) -> List[Message]:
        """Return the initial pose once a node subscribes to it, and only once; otherwise an empty list."""
        if self._initial_pose is None or not self._graph.subscribers_of(self._graph.names(INITIAL_POSE)):
            return []
        pose, self._initial_pose = self._initial_pose, None
        return [(INITIAL_POSE, pose)]

    def lacks_scan(self, now: int, messages: Sequence[Message]) -> bool:
        """Return whether a lidar has not published its first scan yet. `messages` are the messages of this step.

        `now` is simulated time in ns. Always False without Nav2, and after MAX_FIRST_SCAN_S.
        """
        # Nav2's AMCL needs a scan to publish map -> odom.
        if not self._options.nav2 or now >= MAX_FIRST_SCAN_S * NS_PER_S:
            return False
        known = {*self._latest, *(topic for topic, _ in messages)}
        return any(type_name == SCAN_TYPE and topic not in known for topic, type_name in self._graph.types.items())

    def wait(self, now: int, step_limit_s: float) -> None:
        """Publish the latest readings with advancing ROS time until all nodes are ready.

        `now` is simulated time in ns. Raises AdapterError if nodes are not ready after the wall time `--ready` or
        `step_limit_s`, whichever is shorter. Raises BringUpAborted if the lifecycle manager of a launched Nav2 has
        given up.
        """
        remaining_s = self._options.ready - (0.0 if self._options.warm_up else time.monotonic() - self._started_at)
        self._readiness.has_map = MAP in self._latest
        for topic in LATCHED_TOPICS.intersection(self._latest):
            self._graph.publish(topic, self._latest.pop(topic))

        def publish() -> None:
            self._graph.offset_ns += round(self._period * NS_PER_S)
            self._graph.publish_clock(now)
            for topic, data in [*self._latest.items(), *self.due_initial_pose()]:
                self._graph.publish(topic, data)

        pace = self._options.factor if self._options.sync == "paced" else 1.0
        wall_clock = Clock(clock_type=ClockType.STEADY_TIME)
        timer = self._graph.node.create_timer(self._period / pace, publish, clock=wall_clock)
        missing: List[str] = []
        changed_at, nodes = time.monotonic(), self._graph.nodes()

        def is_complete() -> bool:
            nonlocal changed_at, nodes
            missing[:] = self._readiness.problems()
            self._check_unavailable()
            if self._report is not None:
                self._report.follow_log()
                if missing and self._options.launch and self._report.aborted_bring_up:
                    raise BringUpAborted(self._reasons(missing), self._report.aborted_bring_up)
            if missing or nodes != self._graph.nodes():
                changed_at, nodes = time.monotonic(), self._graph.nodes()
            return not missing and time.monotonic() - changed_at >= self._options.settle

        try:
            if not self._graph.spin_until(_throttled(is_complete), max(0.5, min(remaining_s, step_limit_s))):
                raise AdapterError(self._reasons(missing))
        finally:
            self._graph.node.destroy_timer(timer)
        self._graph.offset_ns += round(self._period * NS_PER_S)
        waited, ahead = time.monotonic() - self._started_at, self._graph.offset_ns / NS_PER_S
        print(f"simscen ros2: ready after {waited:.1f} s; ROS time = time of the run + {ahead:g} s", file=sys.stderr)

    def _reasons(self, missing: Sequence[str]) -> str:
        """Return the error message for nodes that are not ready."""
        waited = time.monotonic() - self._started_at
        reasons = list(dict.fromkeys([*self._readiness.likely_causes(), *missing]))
        text = "; ".join(reasons) or "nodes keep appearing and disappearing"
        errors = [] if self._report is None else self._report.errors()
        text += f"; errors in the log: {'; '.join(errors)}" if errors else ""
        manager = "" if self._report is None else self._report.aborted_bring_up
        text = f"{manager} has given up the bring-up: {text}" if manager else text
        return f"the graph is not ready after {waited:.0f} s: {text}"

    def _check_unavailable(self) -> None:
        """Raise AdapterError if a node subscribes to a topic whose message type this Python does not have."""
        for topic in self._unavailable:
            for subscriber in self._graph.subscribers_of(self._graph.names(topic.name)):
                package = topic.type.partition("/")[0]
                raise AdapterError(
                    f"{subscriber.node} subscribes to {self._graph.names(topic.name)}, which cannot be published: "
                    f"{sys.executable} has no {package}; install it, or do not publish the topic: "
                    f"--without {topic.name}"
                )


def _throttled(check: Callable[[], bool]) -> Callable[[], bool]:
    """Return a function that calls `check` once per CHECK_PERIOD_S and returns False in between."""
    due_at = -math.inf

    def call() -> bool:
        nonlocal due_at
        if time.monotonic() < due_at:
            return False
        result = check()
        due_at = time.monotonic() + CHECK_PERIOD_S
        return result

    return call
