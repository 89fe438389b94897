"""Wait until all nodes of the stack are ready, and publish sensor data meanwhile if they need it.

Nodes such as Nav2's become active only while time advances and sensor data arrive: a costmap waits for
odom -> base_link, a planner for the pose on the map. `BringUp.prepare` first waits without sensor data, which is enough
for other nodes. If nodes are missing or inactive afterwards, `BringUp.wait` publishes the readings of the first step
repeatedly. ROS time advances meanwhile, but the time of the run does not (`Graph.offset_ns` is the difference).
"""

import math
import sys
import time
from typing import Callable, Dict, List, Optional, Sequence

from rclpy.clock import Clock, ClockType

from simscen.ros2.graph import LATCHED, Graph, Topic
from simscen.ros2.messages import NANOSECONDS, SCAN_TYPE
from simscen.ros2.nav2.report import Nav2Report
from simscen.ros2.options import AdapterError, BringUpAborted, Options
from simscen.ros2.readiness import MAP, Readiness
from simscen.ros2.synchronization import Message

INITIAL_POSE = "/initialpose"
PREPARE_S = 10.0
"""Maximum wall time to wait without sensor data."""
PREPARE_SETTLE_S = 2.0
"""Wall time without new nodes, in addition to `--settle`, after which nodes probably wait for sensor data."""
CHECK_PERIOD_S = 0.25
"""Wall time between two checks of the graph. More checks would slow down nodes that are starting."""
FIRST_SCAN_S = 2.0
"""Maximum simulated time, at real-time speed, to wait for the first scan of each lidar."""


class BringUp:
    """Waits for the nodes of a run, and keeps the latest readings to publish them until the nodes are ready."""

    def __init__(
        self,
        graph: Graph,
        readiness: Readiness,
        options: Options,
        period_s: float,
        unavailable: Sequence[Topic],
        report: Optional[Nav2Report],
    ) -> None:
        """`period_s` is the control period, `unavailable` topics without installed type; `report` is for Nav2 only."""
        self._graph, self._readiness, self._options, self._period = graph, readiness, options, period_s
        self._unavailable, self._report = list(unavailable), report
        self._started_at = time.monotonic()
        self._latest: Dict[str, bytes] = {}
        self._initial_pose: Optional[bytes] = None

    @property
    def latest_start_s(self) -> float:
        """Simulated time in s by which the nodes must be ready."""
        return max(self._options.warm_up, FIRST_SCAN_S if self._options.nav2 else 0.0) + self._period

    def prepare(self) -> bool:
        """Wait before the first step; return whether all nodes are ready without sensor data.

        Raises AdapterError if the launch command ends, or a node needs a topic that cannot be published.
        """
        changed_at = incomplete_at = time.monotonic()
        nodes = self._graph.nodes()
        settle = self._options.settle
        patience = settle if self._options.nav2 or self._options.warm_up else settle + PREPARE_SETTLE_S
        missing: List[str] = []

        def settled() -> bool:
            nonlocal changed_at, incomplete_at, nodes
            missing[:] = self._readiness.no_nodes() if self._options.warm_up else self._readiness.missing()
            self._check_unavailable()
            now = time.monotonic()
            if nodes != self._graph.nodes():
                changed_at, nodes = now, self._graph.nodes()
            if missing:
                incomplete_at = now
                return bool(nodes) and now - changed_at >= patience
            return now - max(changed_at, incomplete_at) >= settle

        is_settled = self._graph.spin_until(_throttled(settled), min(self._options.ready, PREPARE_S))
        return is_settled and not missing and not self._options.warm_up

    def keep(self, messages: Sequence[Message]) -> None:
        """Keep the latest message of each topic, so that `wait` can publish it."""
        self._latest.update(messages)

    def keep_initial_pose(self, messages: Sequence[Message]) -> List[Message]:
        """Keep the initial pose until a node subscribes to it; return the other messages."""
        self._initial_pose = dict(messages).get(INITIAL_POSE, self._initial_pose)
        return [message for message in messages if message[0] != INITIAL_POSE]

    def due_initial_pose(self) -> List[Message]:
        """Return the initial pose if it has not been returned yet and a node subscribes to it."""
        if self._initial_pose is None or not self._graph.subscribers_of(self._graph.names(INITIAL_POSE)):
            return []
        pose, self._initial_pose = self._initial_pose, None
        return [(INITIAL_POSE, pose)]

    def lacks_scan(self, now: int, messages: Sequence[Message]) -> bool:
        """Return whether to simulate on, at most until FIRST_SCAN_S, because a lidar has not measured yet.

        Nav2's AMCL needs a scan to publish map -> odom, so `wait` would not succeed without one. `now` is the time of
        the run in ns, and `messages` are those of this step.
        """
        if not self._options.nav2 or now >= FIRST_SCAN_S * NANOSECONDS:
            return False
        known = {*self._latest, *(topic for topic, _ in messages)}
        return any(type_name == SCAN_TYPE and topic not in known for topic, type_name in self._graph.types.items())

    def wait(self, now: int, step_limit_s: float) -> None:
        """Publish the latest readings with advancing ROS time until all nodes are ready; `now` is the run's time in ns.

        Raises AdapterError with what is missing after the wall time `--ready` or `step_limit_s`, and BringUpAborted if
        the lifecycle manager of a launched Nav2 has given up.
        """
        remaining_s = self._options.ready - (0.0 if self._options.warm_up else time.monotonic() - self._started_at)
        self._readiness.has_map = MAP in self._latest
        for topic in LATCHED.intersection(self._latest):
            self._graph.publish(topic, self._latest.pop(topic))

        def publish() -> None:
            self._graph.offset_ns += round(self._period * NANOSECONDS)
            self._graph.publish_clock(now)
            for topic, data in [*self._latest.items(), *self.due_initial_pose()]:
                self._graph.publish(topic, data)

        pace = self._options.factor if self._options.sync == "paced" else 1.0
        wall_clock = Clock(clock_type=ClockType.STEADY_TIME)
        timer = self._graph.node.create_timer(self._period / pace, publish, clock=wall_clock)
        missing: List[str] = []
        changed_at, nodes = time.monotonic(), self._graph.nodes()

        def complete() -> bool:
            nonlocal changed_at, nodes
            missing[:] = self._readiness.missing()
            self._check_unavailable()
            if self._report is not None:
                self._report.follow_log()
                if missing and self._options.launch and self._report.aborted_bring_up:
                    raise BringUpAborted(self._reasons(missing), self._report.aborted_bring_up)
            if missing or nodes != self._graph.nodes():
                changed_at, nodes = time.monotonic(), self._graph.nodes()
            return time.monotonic() - changed_at >= self._options.settle

        try:
            if not self._graph.spin_until(_throttled(complete), max(0.5, min(remaining_s, step_limit_s))):
                raise AdapterError(self._reasons(missing))
        finally:
            self._graph.node.destroy_timer(timer)
        self._graph.offset_ns += round(self._period * NANOSECONDS)
        waited, ahead = time.monotonic() - self._started_at, self._graph.offset_ns / NANOSECONDS
        print(f"simscen ros2: ready after {waited:.1f} s; ROS time = time of the run + {ahead:g} s", file=sys.stderr)

    def end(self) -> None:
        """Forget the readings, because all nodes are ready."""
        self._latest.clear()

    def _reasons(self, missing: Sequence[str]) -> str:
        """Return the message of the error for nodes that are not ready."""
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
            for end in self._graph.subscribers_of(self._graph.names(topic.name)):
                package = topic.type.partition("/")[0]
                raise AdapterError(
                    f"{end.node} subscribes to {self._graph.names(topic.name)}, which cannot be published: "
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
