"""Send goals to the nodes, by a Nav2 action or a pose on /goal_pose, and observe their outcomes."""

import math
from functools import partial
from typing import Any, Dict, List, NamedTuple, Optional, Sequence, Union

from rclpy.action import ActionClient

from simscen.peer.goals import Goal
from simscen.ros2.graph import Graph
from simscen.ros2.messages import NS_PER_S, Pose, find_type, wrap_angle
from simscen.ros2.node_barrier import NodeBarrier
from simscen.ros2.options import AdapterError

POSE_TYPE = "geometry_msgs/msg/PoseStamped"
GOAL_POSE = "/goal_pose"
ACTIONS = {
    "navigate_to_pose": "nav2_msgs/action/NavigateToPose",
    "navigate_through_poses": "nav2_msgs/action/NavigateThroughPoses",
    "follow_waypoints": "nav2_msgs/action/FollowWaypoints",
}
STANDSTILL_NS = NS_PER_S
"""Simulated time with zero commands after which a goal on /goal_pose counts as reached."""
REJECTED_CODE, UNKNOWN_CODE = 1, 9000
"""Error codes for a rejected goal and for an unknown error."""
SUCCEEDED, CANCELED, ABORTED = 4, 5, 6
"""Values of action_msgs/msg/GoalStatus.status."""


class GoalReached(NamedTuple):
    """Outcome of a sent goal: reached."""


class GoalFailed(NamedTuple):
    """Outcome of a sent goal: failed, with an error code of Nav2."""

    code: int
    message: str


Outcome = Union[GoalReached, GoalFailed]


class StackState(NamedTuple):
    """State of the stack in the current step.

    now:         simulated time in ns
    is_stopped:  whether the last command is zero
    pose:        pose estimate of the stack; None if unknown
    """

    now: int
    is_stopped: bool
    pose: Optional[Pose]


class GoalPoseSender:
    """Publishes a pose on /goal_pose, as RViz does.

    The stack does not report the result of the goal. The goal counts as reached if the stack commands zero velocity for
    STANDSTILL_NS while its pose estimate is within the tolerances of the goal. A stop elsewhere has no effect.
    """

    takes_single_goals = True
    """Whether the nodes take only one goal at a time."""

    def __init__(self, graph: Graph) -> None:
        self._graph = graph
        self._goal: Optional[Goal] = None
        self._stopped_since: Optional[int] = None
        graph.advertise(GOAL_POSE, POSE_TYPE)

    @property
    def name(self) -> str:
        """Name of the topic in the graph."""
        return self._graph.names(GOAL_POSE)

    def problems(self) -> List[str]:
        """Return a reason why goals cannot be sent (no subscriber), or an empty list."""
        found = self._graph.subscribers_of(self.name)
        return [] if found else [f"no node takes goals: no subscriber of {self.name} ({POSE_TYPE})"]

    def send(self, goals: Sequence[Goal], now: int, barrier: NodeBarrier) -> Optional[GoalFailed]:
        """Send the first goal. Always returns None."""
        from rclpy.serialization import serialize_message

        self._goal, self._stopped_since = goals[0], None
        self._graph.publish(GOAL_POSE, serialize_message(pose_stamped(goals[0], now)))
        return None

    def outcomes(self, state: StackState) -> List[Outcome]:
        """Return GoalReached if the robot has stopped at the goal, or an empty list."""
        if self._goal is None:
            return []
        if not (state.is_stopped and state.pose is not None and _is_within_tolerance(self._goal, state.pose)):
            self._stopped_since = None
            return []
        if self._stopped_since is None:
            self._stopped_since = state.now
        if state.now - self._stopped_since < STANDSTILL_NS:
            return []
        self._goal = None
        return [GoalReached()]

    def cancel(self, state: StackState, barrier: NodeBarrier) -> None:
        """Send the current pose as the goal, because a pose cannot be canceled."""
        if self._goal is not None and state.pose is not None:
            x, y, yaw = state.pose
            self.send([self._goal._replace(x=x, y=y, yaw=yaw)], state.now, barrier)
        self._goal = None


class ActionSender:
    """Sends goals by one of Nav2's ACTIONS. Raises AdapterError if the action type is not installed."""

    def __init__(self, graph: Graph, action: str) -> None:
        self._graph, self.action, self.name = graph, action, graph.names("/" + action)
        self.type = ACTIONS[action]
        action_type = find_type(self.type)
        if action_type is None:
            raise AdapterError(
                f"this ROS has no {self.type}: install nav2_msgs, or take goals by /goal_pose (--goals goal_pose)"
            )
        self._type: Any = action_type
        self._client = ActionClient(graph.node, action_type, self.name)
        self._handle: Any = None
        self._result: Any = None
        self._goals: Sequence[Goal] = ()
        self._passed = self._reported = self.recoveries = 0

    @property
    def takes_single_goals(self) -> bool:
        """Whether the nodes take only one goal at a time."""
        return self.action == "navigate_to_pose"

    def problems(self) -> List[str]:
        """Return a reason why goals cannot be sent (no action server), or an empty list."""
        if self._client.server_is_ready():
            return []
        return [f"no node takes goals: no action server {self.name} ({self.type})"]

    def send(self, goals: Sequence[Goal], now: int, barrier: NodeBarrier) -> Optional[GoalFailed]:
        """Send goals; return GoalFailed if they are rejected. Raises AdapterError if the server does not answer."""
        request = self._type.Goal()
        poses = [pose_stamped(goal, now + self._graph.offset_ns) for goal in goals]
        if self.takes_single_goals:
            request.pose, goals = poses[0], goals[:1]
        elif hasattr(request.poses, "goals"):  # nav_msgs/Goals since Kilted, a plain list before
            request.poses.goals = poses
            request.poses.header = poses[0].header
        else:
            request.poses = poses
        self._goals, self._passed, self._reported, self.recoveries = goals, 0, 0, 0
        self._result = None
        answer = self._client.send_goal_async(request, feedback_callback=partial(self._process_feedback, goals))
        barrier.wait(answer, f"{self.name} has not accepted or rejected the goal")
        self._handle = answer.result()
        if not self._handle.accepted:
            self._handle = None
            return GoalFailed(REJECTED_CODE, f"{self.name} rejected the goal")
        self._result = self._handle.get_result_async()
        return None

    def _process_feedback(self, goals: Sequence[Goal], message: Any) -> None:
        """Update the number of passed goals and of recoveries. Late feedback on earlier `goals` is ignored."""
        if goals is not self._goals:
            return
        feedback = message.feedback
        self.recoveries = getattr(feedback, "number_of_recoveries", 0)
        if self.action == "navigate_through_poses":
            remaining = feedback.number_of_poses_remaining
            # A server that does not count reports 0.
            self._passed = max(self._passed, len(self._goals) - remaining) if remaining else self._passed
        elif self.action == "follow_waypoints":
            self._passed = max(self._passed, min(feedback.current_waypoint, len(self._goals) - 1))

    def outcomes(self, state: StackState) -> List[Outcome]:
        """Return the outcomes since the last call, in the order of the goals that were sent."""
        if self._handle is None:
            return []
        if not self._result.done():
            return self._passed_goals(state)
        answer = self._result.result()
        self._handle = None
        result = answer.result
        if answer.status == SUCCEEDED:
            missed = self._missed_waypoints(result)
            return [missed.get(index, GoalReached()) for index in range(self._reported, len(self._goals))]
        ending = {CANCELED: "was canceled by the stack", ABORTED: "was aborted"}.get(answer.status, "ended")
        code = getattr(result, "error_code", 0) or UNKNOWN_CODE
        message = getattr(result, "error_msg", "") or f"{self.name} {ending}"
        # Goals that were not attempted fail with the current one.
        return [*self._passed_goals(state), *[GoalFailed(code, message)] * (len(self._goals) - self._passed)]

    def _missed_waypoints(self, result: Any) -> Dict[int, GoalFailed]:
        """Return the failures in a result of FollowWaypoints, by the index of the goal."""
        missed: Dict[int, GoalFailed] = {}
        for waypoint in getattr(result, "missed_waypoints", ()):
            index = waypoint.waypoint_index if hasattr(waypoint, "waypoint_index") else waypoint.index
            code, message = getattr(waypoint, "error_code", 0) or UNKNOWN_CODE, getattr(waypoint, "error_msg", "")
            missed[index] = GoalFailed(code, message or f"{self.name} missed this waypoint")
        return missed

    def _passed_goals(self, state: StackState) -> List[Outcome]:
        """Return the outcomes of the goals passed since the last call, according to the feedback."""
        # FollowWaypoints gives the same feedback for reached and missed goals. Therefore, the pose estimate decides.
        found: List[Outcome] = []
        for goal in self._goals[self._reported : self._passed]:
            is_at_goal = state.pose is not None and _is_within_tolerance(goal, state.pose)
            if is_at_goal or self.action == "navigate_through_poses":
                found.append(GoalReached())
            else:
                message = f"{self.name} continued, although the robot was not at the goal"
                found.append(GoalFailed(UNKNOWN_CODE, message))
        self._reported = self._passed
        return found

    def cancel(self, state: StackState, barrier: NodeBarrier) -> None:
        """Cancel the goals that were sent. Raises AdapterError if the server does not answer in time."""
        if self._handle is not None:
            barrier.wait(self._handle.cancel_goal_async(), f"{self.name} has not answered the request to cancel")
            self._handle = None


GoalSender = Union[GoalPoseSender, ActionSender]


class GoalSenders:
    """Senders that the value `requested` of the option `--goals` allows; `auto`: NavigateToPose and /goal_pose."""

    def __init__(self, graph: Graph, requested: str) -> None:
        self._senders: List[GoalSender] = []
        action = "navigate_to_pose" if requested == "auto" else requested
        if action in ACTIONS and (requested != "auto" or find_type(ACTIONS[action]) is not None):
            self._senders.append(ActionSender(graph, action))
        if requested in ("auto", "goal_pose"):
            self._senders.append(GoalPoseSender(graph))

    @property
    def usable(self) -> Optional[GoalSender]:
        """The first sender with an action server or a subscriber; None if there is none."""
        return next((sender for sender in self._senders if not sender.problems()), None)

    def problems(self) -> List[str]:
        """Return a reason why goals cannot be sent, or an empty list."""
        if self.usable is not None:
            return []
        reasons = [sender.problems()[0] for sender in self._senders]
        return [reasons[0] + "".join(", and " + reason.partition(": ")[2] for reason in reasons[1:])]


def pose_stamped(goal: Goal, now: int) -> Any:
    """Return the goal as geometry_msgs/msg/PoseStamped in the map frame, with the stamp `now` in ns."""
    message: Any = find_type(POSE_TYPE)()  # type: ignore[misc]
    message.header.frame_id = "map"
    message.header.stamp.sec, message.header.stamp.nanosec = divmod(now, NS_PER_S)
    message.pose.position.x, message.pose.position.y = goal.x, goal.y
    message.pose.orientation.z, message.pose.orientation.w = math.sin(goal.yaw / 2), math.cos(goal.yaw / 2)
    return message


def _is_within_tolerance(goal: Goal, pose: Pose) -> bool:
    is_near = math.hypot(pose[0] - goal.x, pose[1] - goal.y) <= goal.xy_tolerance
    return is_near and abs(wrap_angle(pose[2] - goal.yaw)) <= goal.yaw_tolerance
