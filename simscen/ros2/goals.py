"""The doors by which a stack takes goals: Nav2's actions, or a pose on /goal_pose."""

import math
from typing import Any, Dict, List, NamedTuple, Optional, Sequence, Union

from rclpy.action import ActionClient

from simscen.peer.goals import Goal
from simscen.ros2 import cdr, interfaces
from simscen.ros2.failure import Failure
from simscen.ros2.graph import Graph
from simscen.ros2.rest import Rest

POSE_TYPE = "geometry_msgs/msg/PoseStamped"
GOAL_POSE = "/goal_pose"
ACTIONS = {
    "navigate_to_pose": "nav2_msgs/action/NavigateToPose",
    "navigate_through_poses": "nav2_msgs/action/NavigateThroughPoses",
    "follow_waypoints": "nav2_msgs/action/FollowWaypoints",
}
STAND_STILL = cdr.NANOSECONDS
"""How long the command must be zero for a goal of /goal_pose to count as reached, in simulated nanoseconds."""
REJECTED, UNKNOWN = 1, 9000
"""Error codes of Nav2."""
SUCCEEDED, CANCELED, ABORTED = 4, 5, 6
"""action_msgs/msg/GoalStatus."""


class Reached(NamedTuple):
    """The first of the goals that were sent is reached."""


class Failed(NamedTuple):
    """The first of the goals that were sent is given up."""

    code: int
    message: str


Outcome = Union[Reached, Failed]


class Now(NamedTuple):
    """What a door may look at: the time, whether the command is zero, and where the stack believes to be."""

    nanoseconds: int
    still: bool
    belief: Optional[cdr.Pose]


class GoalPose:
    """A pose on /goal_pose, as RViz sends it. Nobody says how it ends, so it is told from what the stack does.

    The goal counts as reported reached when the command has been zero for a simulated second while the stack's own
    estimate is within the goal's tolerances. Standing elsewhere says nothing; the goal's timeout ends that.
    """

    one_by_one = True

    def __init__(self, graph: Graph) -> None:
        self._graph, self._goal = graph, None  # type: Graph, Optional[Goal]
        self._still_since: Optional[int] = None
        self._kind = interfaces.find(POSE_TYPE)
        graph.offer(GOAL_POSE, POSE_TYPE)

    @property
    def name(self) -> str:
        """Where goals go, for people."""
        return self._graph.names(GOAL_POSE)

    def missing(self) -> List[str]:
        """Somebody must listen."""
        ends = self._graph.subscribers(self.name)
        return [] if ends else [f"nobody takes goals: no subscriber of {self.name} ({POSE_TYPE})"]

    def send(self, goals: Sequence[Goal], now: int, rest: Rest) -> Optional[Failed]:
        """Send the first goal."""
        from rclpy.serialization import serialize_message

        self._goal, self._still_since = goals[0], None
        self._graph.publish(GOAL_POSE, serialize_message(pose_stamped(goals[0], now)))
        return None

    def outcomes(self, now: Now) -> List[Outcome]:
        """Whether it stands where it should."""
        if self._goal is None:
            return []
        if not (now.still and now.belief is not None and _within(self._goal, now.belief)):
            self._still_since = None
            return []
        if self._still_since is None:
            self._still_since = now.nanoseconds
        if now.nanoseconds - self._still_since < STAND_STILL:
            return []
        self._goal = None
        return [Reached()]

    def cancel(self, now: Now, rest: Rest) -> None:
        """Nobody can call a pose back: the stack is sent where it stands."""
        if self._goal is not None and now.belief is not None:
            self.send([self._goal._replace(x=now.belief[0], y=now.belief[1], yaw=now.belief[2])], now.nanoseconds, rest)
        self._goal = None


class Action:
    """One of Nav2's actions."""

    def __init__(self, graph: Graph, short: str, name: str) -> None:
        self._graph, self.short, self.name = graph, short, name
        self.type = ACTIONS[short]
        kind = interfaces.find(self.type)
        if kind is None:
            raise Failure(
                f"this ROS has no {self.type}: install nav2_msgs, or take goals by /goal_pose (--goals goal_pose)"
            )
        self._kind: Any = kind
        self._client = ActionClient(graph.node, kind, name)
        self._handle: Any = None
        self._result: Any = None
        self._goals: Sequence[Goal] = ()
        self._passed = self._reported = 0

    @property
    def one_by_one(self) -> bool:
        """Whether it takes one goal at a time."""
        return self.short == "navigate_to_pose"

    def missing(self) -> List[str]:
        """Its server must be there."""
        return (
            []
            if self._client.server_is_ready()
            else [f"nobody takes goals: no action server {self.name} ({self.type})"]
        )

    def send(self, goals: Sequence[Goal], now: int, rest: Rest) -> Optional[Failed]:
        """Send the goals, and wait until they are accepted; Failed when they are not."""
        request = self._kind.Goal()
        poses = [pose_stamped(goal, now) for goal in goals]
        if self.one_by_one:
            request.pose, goals = poses[0], goals[:1]
        # nav_msgs/Goals since Kilted, a plain list before.
        elif hasattr(request.poses, "goals"):
            request.poses.goals = poses
            request.poses.header = poses[0].header
        else:
            request.poses = poses
        self._goals, self._passed, self._reported = goals, 0, 0
        self._result = None
        answer = self._client.send_goal_async(request, feedback_callback=self._feedback)
        rest.wait(answer, f"{self.name} has not accepted or rejected the goal")
        self._handle = answer.result()
        if not self._handle.accepted:
            self._handle = None
            return Failed(REJECTED, f"{self.name} rejected the goal")
        self._result = self._handle.get_result_async()
        return None

    def _feedback(self, message: Any) -> None:
        feedback = message.feedback
        if self.short == "navigate_through_poses":
            left = feedback.number_of_poses_remaining
            # 0 is also what a server says that does not count.
            self._passed = max(self._passed, len(self._goals) - left) if left else self._passed
        elif self.short == "follow_waypoints":
            self._passed = max(self._passed, min(feedback.current_waypoint, len(self._goals) - 1))

    def outcomes(self, now: Now) -> List[Outcome]:
        """What the feedback and the result say, of each goal that was sent, in order."""
        if self._handle is None:
            return []
        missed: Dict[int, Failed] = {}
        found: List[Outcome] = []
        if self._result.done():
            answer = self._result.result()
            self._handle = None
            result = answer.result
            for waypoint in getattr(result, "missed_waypoints", ()):
                index = waypoint.waypoint_index if hasattr(waypoint, "waypoint_index") else waypoint.index
                code, message = getattr(waypoint, "error_code", 0) or UNKNOWN, getattr(waypoint, "error_msg", "")
                missed[index] = Failed(code, message or f"{self.name} missed it")
            if answer.status == SUCCEEDED:
                for index in range(self._reported, len(self._goals)):
                    found.append(missed.get(index, Reached()))
                return found
            said = {CANCELED: "was canceled by the stack", ABORTED: "was aborted"}.get(answer.status, "ended")
            code = getattr(result, "error_code", 0) or UNKNOWN
            message = getattr(result, "error_msg", "") or f"{self.name} {said}"
            found += [self._passed_by(goal, now) for goal in self._goals[self._reported : self._passed]]
            # What was not tried failed with the rest.
            return [*found, *[Failed(code, message)] * (len(self._goals) - self._passed)]
        found += [self._passed_by(goal, now) for goal in self._goals[self._reported : self._passed]]
        self._reported = self._passed
        return found

    def _passed_by(self, goal: Goal, now: Now) -> Outcome:
        """A goal that the feedback has left behind. FollowWaypoints' does not tell whether it was reached or missed."""
        there = now.belief is not None and _within(goal, now.belief)
        if there or self.short == "navigate_through_poses":
            return Reached()
        return Failed(UNKNOWN, f"{self.name} went on without having been there")

    def cancel(self, now: Now, rest: Rest) -> None:
        """Cancel what was sent."""
        if self._handle is not None:
            rest.wait(self._handle.cancel_goal_async(), f"{self.name} has not answered to a cancel")
            self._handle = None


Door = Union[GoalPose, Action]


class Doors:
    """Chooses the door: the one that is wanted, or the first that somebody stands behind."""

    def __init__(self, graph: Graph, wanted: str) -> None:
        self._doors: List[Door] = []
        for short in ACTIONS if wanted == "auto" else (wanted,):
            if short == "goal_pose" or (wanted == "auto" and short != "navigate_to_pose"):
                continue
            if wanted == "auto" and interfaces.find(ACTIONS[short]) is None:
                continue
            self._doors.append(Action(graph, short, graph.names("/" + short)))
        if wanted in ("auto", "goal_pose"):
            self._doors.append(GoalPose(graph))

    @property
    def door(self) -> Optional[Door]:
        """The first door that is open."""
        return next((door for door in self._doors if not door.missing()), None)

    def missing(self) -> List[str]:
        """What keeps goals from being taken."""
        if self.door is not None:
            return []
        reasons = [door.missing()[0] for door in self._doors]
        return [reasons[0] + "".join(", and " + reason.partition(": ")[2] for reason in reasons[1:])]


def pose_stamped(goal: Goal, now: int) -> Any:
    """The goal as geometry_msgs/msg/PoseStamped in the map frame."""
    message: Any = interfaces.find(POSE_TYPE)()  # type: ignore[misc]
    message.header.frame_id = "map"
    message.header.stamp.sec, message.header.stamp.nanosec = divmod(now, cdr.NANOSECONDS)
    message.pose.position.x, message.pose.position.y = goal.x, goal.y
    message.pose.orientation.z, message.pose.orientation.w = math.sin(goal.yaw / 2), math.cos(goal.yaw / 2)
    return message


def _within(goal: Goal, pose: cdr.Pose) -> bool:
    near = math.hypot(pose[0] - goal.x, pose[1] - goal.y) <= goal.xy_tolerance
    return near and abs(cdr.turned(pose[2] - goal.yaw)) <= goal.yaw_tolerance
