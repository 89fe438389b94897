"""Adapter by which ROS nodes act as the stack of a run: publishes sensor data, sends goals, and returns commands."""

import math
import os
import sys
from importlib.metadata import version
from typing import Any, Dict, List, Optional, Sequence, Set, Tuple

import rclpy

from simscen.peer.goals import Goal, Goals
from simscen.ros2.bring_up import BringUp
from simscen.ros2.goal_sender import ACTIONS, ActionSender, GoalFailed, GoalSender, GoalSenders, StackState
from simscen.ros2.graph import CLOCK, LATCHED_TOPICS, Graph, ReceivedMessage, Topic
from simscen.ros2.graph_names import FrameNames, TopicNames
from simscen.ros2.launch import LaunchedCommand
from simscen.ros2.messages import NS_PER_S, TF_STATIC, find_type, read_twist, write_twist
from simscen.ros2.nav2.actions import MotionActions, RecoveryReporter
from simscen.ros2.nav2.filter_info import FilterInfo
from simscen.ros2.nav2.report import LogLine, Nav2Report
from simscen.ros2.node_barrier import NodeBarrier
from simscen.ros2.options import AdapterError, Options
from simscen.ros2.pose_estimate import PLAN, PoseEstimate
from simscen.ros2.readiness import COMMAND, TWIST_STAMPED_TYPE, Readiness
from simscen.ros2.synchronization import LockstepSynchronization, Message, PacedSynchronization
from simscen.ros2.user_transforms import UserTransforms

SUBSCRIPTIONS = {
    "/plan": "nav_msgs/msg/Path",
    "/amcl_pose": "geometry_msgs/msg/PoseWithCovarianceStamped",
    "/particle_cloud": "nav2_msgs/msg/ParticleCloud",
    "/tf": "tf2_msgs/msg/TFMessage",
    "/global_costmap/costmap": "nav_msgs/msg/OccupancyGrid",
    "/local_costmap/costmap": "nav_msgs/msg/OccupancyGrid",
}
"""Topics that the adapter receives from the nodes in addition to /cmd_vel, and their types."""
THROUGH_POSES = "navigate_through_poses"
STOP = (0.0,) * 6
"""Linear and angular velocity (x, y, z) of a zero command."""
MAX_WAIT_FRACTION = 0.8
"""Fraction of the maximum wall time of a step that the adapter waits for nodes."""


class Adapter:
    """ROS nodes as the stack of one run. Call `prepare` first, then `step` repeatedly, then `end`."""

    def __init__(
        self,
        options: Options,
        topics: Sequence[Topic],
        goals: Goals,
        launch_command: Optional[LaunchedCommand],
        period_s: float,
        answer_limit_s: float,
        filter_info: FilterInfo,
        restart_reason: str,
    ) -> None:
        """Join the ROS graph and create publishers.

        Args:
            topics: Topics of the robot that simscen can publish.
            goals: Queue of goals.
            launch_command: The user's running launch command; None if the user starts the nodes.
            period_s: Control period.
            answer_limit_s: Maximum wall time for the answer to a step after the nodes are ready.
            filter_info: Messages that describe the zone masks among `topics`.
            restart_reason: Reason why the launch command was started a second time; empty the first time.
        """
        if not rclpy.ok():
            rclpy.init(args=[])
        self._options, self._goals, self._answer_limit_s = options, goals, answer_limit_s
        self._launch_command = launch_command
        self._graph = Graph(TopicNames(options.namespace, options.remap), self._check_launch_command)
        self._frames = FrameNames(options.frame, options.base_frame)
        self._estimate = PoseEstimate()
        self._senders = GoalSenders(self._graph, options.goals)
        self._sender: Optional[GoalSender] = None
        self._barrier = NodeBarrier(self._graph, options.answer)
        self._velocity: Tuple[float, ...] = STOP
        self.is_ready = False
        self.mode = ""
        """Nav2 action by which the scenario sends goals. The caller sets it with the goals."""
        self.continue_after_failure = True
        """Whether to send the next goal after a failed one. The caller sets it with the goals."""
        self._open_goal_count = 0
        self._planned_goal: Optional[Goal] = None
        self._unused_masks: List[str] = []
        self.restart_reason = restart_reason
        self._filter_info = filter_info
        self._pending_infos = filter_info.messages(self._graph.names)
        offered = [Topic(CLOCK, "rosgraph_msgs/msg/Clock"), *topics, *filter_info.topics]
        offered = [topic for topic in offered if topic.name not in options.without]
        self._unavailable = [topic for topic in offered if not self._graph.advertise(topic.name, topic.type)]
        published = [topic for topic in offered if topic.name in self._graph.publishers]
        self._readiness = Readiness(
            self._graph, self._barrier, published, self._senders, options, self._frames.base_frames
        )
        self._actions = MotionActions(self._graph, self._barrier)
        self._recoveries = RecoveryReporter(self._graph, goals.report)
        self._report = Nav2Report(self._graph, self._barrier) if options.nav2 else None
        self._bring_up = BringUp(self._graph, self._readiness, options, period_s, self._unavailable, self._report)
        self._lockstep = LockstepSynchronization(
            self._graph, self._barrier, self._actions, options.rounds, options.wait, options.answer
        )
        self._paced = PacedSynchronization(self._graph, options.factor)

    @property
    def needed_topics(self) -> Set[str]:
        """Topics that the adapter needs from simscen: the topics that it publishes, and `_replaced_topics`."""
        return {*self._graph.publishers, *self._replaced_topics}

    @property
    def latest_start_s(self) -> float:
        """Simulated time in s at which the nodes must be ready."""
        return self._bring_up.latest_start_s

    @property
    def _replaced_topics(self) -> Set[str]:
        """/tf_static if the user's nodes publish it instead of simscen; otherwise empty."""
        return {TF_STATIC} & set(self._options.without)

    def _check_launch_command(self) -> None:
        """Raise AdapterError if the launch command has ended."""
        if self._launch_command is not None and self._launch_command.end_reason is not None:
            raise AdapterError(
                f"the launched command {self._launch_command.end_reason}: {self._launch_command.command}"
            )

    def run_facts(self) -> Dict[str, Any]:
        """Return facts about the nodes and the synchronization for the run's log."""
        synchronization: Any = self._lockstep if self._options.sync == "lockstep" else self._paced
        facts = {
            "sync": self._options.sync,
            "rclpy": version("rclpy"),
            "distribution": os.environ.get("ROS_DISTRO", "unknown"),
            "rmw": rclpy.get_rmw_implementation_identifier(),
            "nodes": self._barrier.nodes,
            **synchronization.counters,
        }
        if self._options.sync == "paced":
            facts["factor"] = self._options.factor
        if self._barrier.not_in_step:
            facts["not_in_step"] = self._barrier.not_in_step
        warnings = (
            [f"the launched command was started again, because {self.restart_reason}"] if self.restart_reason else []
        )
        warnings += [
            f"{node} does not answer, so lockstep does not wait for it" for node in sorted(self._barrier.silent_nodes)
        ]
        if self.is_ready and (warnings or self._unused_masks):
            facts["warnings"] = [*warnings, *self._unused_masks]
        if self._sender is not None:
            facts["goals"] = self._sender.name
        if self._report is not None:
            facts["parameters"] = self._report.parameters
        if self._unavailable:
            facts["not_published"] = [f"{topic.name} ({topic.type})" for topic in self._unavailable]
        return facts

    def prepare(self) -> None:
        """Wait until all nodes are ready, or until they probably need sensor data to become ready.

        Raises AdapterError if the launch command ends, or a node needs a topic that cannot be published.
        """
        if self._bring_up.prepare() and not self._replaced_topics:
            self._begin()

    def preempt(self, now: int, goal: Goal) -> None:
        """Send `goal` now, so that it preempts the current goal. `now` is simulated time in ns."""
        self._goals.preempt(goal)
        self._send(now)

    def cancel(self, now: int, everything: bool) -> None:
        """Cancel the current goal, or all goals with `everything`. `now` is simulated time in ns."""
        if self._sender is not None and self._goals.current is not None:
            self._sender.cancel(self._state(now), self._barrier)
        self._goals.cancel(everything)

    def step(self, now: int, messages: Sequence[Message], is_command_due: bool, limit_s: float) -> List[Message]:
        """Perform one step of the run: publish `messages`, and return the messages of the nodes.

        The first steps wait until the nodes are ready. Raises AdapterError if they do not become ready, or if a
        required node fails.

        Args:
            now: Simulated time in ns.
            messages: Topics and serialized messages.
            is_command_due: Whether the robot needs a velocity command now.
            limit_s: Maximum wall time for the answer.
        """
        self._check_launch_command()
        limit_s = min(limit_s, self._answer_limit_s) if self.is_ready else limit_s
        messages, self._pending_infos = [*messages, *self._pending_infos], []
        for topic, data in messages:
            self._estimate.process_published(topic, data)
            if topic in self._replaced_topics:
                self._readiness.use_transforms(UserTransforms(self._graph, self._frames, data))
        publishers, rename = self._graph.publishers, self._frames.apply
        messages = [
            (topic, rename(topic, publishers[topic].msg_type, data) if topic in publishers else data)
            for topic, data in messages
        ]
        messages = self._bring_up.hold_initial_pose(messages)
        is_warming_up = now < self._options.warm_up * NS_PER_S
        if not self.is_ready:
            is_warming_up = is_warming_up or self._bring_up.lacks_scan(now, messages)
            self._bring_up.remember_latest(messages)
            if not is_warming_up:
                self._bring_up.wait(now, MAX_WAIT_FRACTION * limit_s)
                # `wait` has published the messages on latched topics.
                messages = [message for message in messages if message[0] not in LATCHED_TOPICS]
                self._begin()
        messages = [*messages, *self._bring_up.due_initial_pose()]
        self._barrier.step_time.begin(MAX_WAIT_FRACTION * limit_s)
        synchronization: Any = self._lockstep if self._options.sync == "lockstep" and not is_warming_up else self._paced
        if not is_warming_up and self._goals.current is None:
            self._send(now)
        received = synchronization.step(now, messages, is_command_due, self._goals.current is not None)
        has_command = any(message.topic == COMMAND for message in received)
        # The order of messages on different topics is random.
        answers = sorted((each for message in received for each in self._process(message)), key=lambda each: each[0])
        if is_command_due or has_command:
            answers.append((COMMAND, write_twist(self._velocity)))
        if self.is_ready:
            if isinstance(self._sender, ActionSender):
                self._recoveries.update_count(self._sender.recoveries)
            self._recoveries.report_clearing(now)
            self._report_outcomes(now)
        return answers

    def take_lines(self) -> List[LogLine]:
        """Return the log lines of Nav2's nodes since the last call."""
        return [] if self._report is None else self._report.take_lines()

    def _begin(self) -> None:
        """Subscribe to the topics of the nodes. Called when all nodes are ready."""
        self.is_ready = True
        self._unused_masks = self._filter_info.unused_masks(
            lambda topic: bool(self._graph.subscribers_of(self._graph.names(topic)))
        )
        self._barrier.begin()
        self._graph.subscribe(COMMAND, self._readiness.command_type())
        for topic, type_name in SUBSCRIPTIONS.items():
            if topic == "/tf" or self._graph.publishers_of(self._graph.names(topic)):
                self._graph.subscribe(topic, type_name)
        self._actions.subscribe()
        self._recoveries.subscribe()
        if self._report is not None:
            self._report.begin()
        self._sender = self._senders.usable

    def _send(self, now: int) -> None:
        """Send the next batch of goals. If it is rejected, report its first goal as failed, and send the next batch."""
        while self._sender is not None and self._goals.accept() is not None:
            batch = self._next_batch()
            self._open_goal_count = 1 if self._sender.takes_single_goals else len(batch)
            failed = self._sender.send(batch, now, self._barrier)
            if failed is None:
                self._recoveries.begin_goal()
                return
            self._goals.failed(failed.code, failed.message, go_on=self.continue_after_failure)

    def _next_batch(self) -> List[Goal]:
        """Return the goals of the next action: up to the first one at which the robot must wait or stop."""
        # Nav2's waypoint follower has one waiting time for all goals. So the robot waits between two actions.
        assert self._goals.current is not None
        remaining = [self._goals.current, *self._goals.waiting]
        stops = (k for k, goal in enumerate(remaining) if goal.wait or (self.mode == THROUGH_POSES and not goal.via))
        return remaining[: next(stops, len(remaining)) + 1]

    def _report_outcomes(self, now: int) -> None:
        """Report the outcomes of the goals that have ended, and accept the next goal of the batch."""
        assert self._sender is not None
        for outcome in self._sender.outcomes(self._state(now)) if self._goals.current is not None else ():
            if self._goals.current is None:
                return
            self._open_goal_count -= 1
            if isinstance(outcome, GoalFailed):
                self._open_goal_count -= len(self._goals.ahead)
                self._goals.failed(outcome.code, outcome.message, go_on=self.continue_after_failure)
            else:
                self._goals.reached()
            if self._open_goal_count <= 0:
                return
            self._goals.accept()

    def _state(self, now: int) -> StackState:
        """Return the current state of the stack for the goal sender."""
        is_stopped = all(abs(number) < 1e-3 for number in self._velocity)
        return StackState(now, is_stopped, self._estimate.pose)

    def _process(self, message: ReceivedMessage) -> List[Message]:
        """Process a message of the nodes. Return the messages to send to simscen, if any."""
        if message.topic == COMMAND:
            self._velocity = read_twist(message.data, message.type == TWIST_STAMPED_TYPE)
            return []
        relevant = self._estimate.process_received(message)
        if message.topic == PLAN:
            self._report_plan()
        return [(message.topic, message.data)] if relevant else []

    def _report_plan(self) -> None:
        """Report a new plan as an event. Its reason is "goal" for the first plan to a goal, otherwise "rate"."""
        goal, plan = self._goals.current, self._estimate.plan
        if goal is None or not plan:
            return
        length = sum(math.dist(a, b) for a, b in zip(plan, plan[1:]))
        reason = "rate" if self._planned_goal is goal else "goal"
        self._planned_goal = goal
        self._goals.report("plan.made", goal.name, reason=reason, length=round(length, 6))

    def end(self) -> None:
        """Leave the graph, and end all processes of the launch command."""
        self._graph.close()
        if rclpy.ok():
            rclpy.shutdown()
        if self._launch_command is not None:
            self._launch_command.end()


def require_packages(options: Options) -> None:
    """Raise AdapterError if this Python lacks message packages that a run with Nav2 needs."""
    needed = ["lifecycle_msgs/srv/GetState"]
    needed += [] if {"/tf", "/tf_static"} <= set(options.without) else ["tf2_msgs/msg/TFMessage"]
    needed += [] if options.goals == "goal_pose" else [ACTIONS["navigate_to_pose"]]
    missing_packages = [name.partition("/")[0] for name in needed if find_type(name) is None]
    if missing_packages:
        raise AdapterError(
            f"{sys.executable} has no {', '.join(missing_packages)}, which Nav2 needs: install the packages "
            "(ros-$ROS_DISTRO-… of apt), or name another Python with --python"
        )
