"""The promises of a goal checker."""

from __future__ import annotations

import math

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import STOP, Twist
from simscen.core.messages.navigation import Goal
from simscen.stack.protocols import GoalChecker
from simscen.testing.contracts.base import ComponentContract, call_component, promise, require

GOAL = Goal("g", Pose2(2.0, -1.0, 0.5), xy_tolerance=0.25, yaw_tolerance=0.25)
LOOKS = 40
"""Two seconds at 20 Hz."""
MOTIONS = (STOP, Twist(0.3), Twist(0.0, 0.0, 0.8), Twist(-0.2, 0.0, -0.4))


class GoalCheckerContract(ComponentContract):
    """Tried with poses on the goal, just outside its tolerances and far away."""

    role = "goal_checker"

    def looked(self, checker: GoalChecker, pose: Pose2, twist: Twist = STOP) -> list[bool]:
        """What it says two seconds long."""
        call_component("is reset", checker.reset)
        said = [call_component("is asked", lambda: checker.reached(GOAL, pose, twist)) for _ in range(LOOKS)]
        require(all(each in (True, False) for each in said), f"answers {said[0]!r}")
        return said

    @promise
    def a_robot_that_stands_on_the_goal_has_reached_it_within_two_seconds(self) -> None:
        """Given a robot that stands on the goal then it says so within two seconds."""
        require(self.looked(self.built(), GOAL.pose)[-1], "does not say that a robot that stands on the goal is there")

    @promise
    def outside_the_tolerances_no_goal_is_reached(self) -> None:
        """Given a robot outside a tolerance of the goal, standing or moving, then it never says so."""
        x, y, yaw = GOAL.pose
        for pose in (
            Pose2(x + 0.26, y, yaw),
            Pose2(x, y - 0.5, yaw),
            Pose2(x, y, yaw + 0.26),
            Pose2(x, y, yaw + math.pi),
        ):
            for twist in MOTIONS:
                said = self.looked(self.built(), pose, twist)
                require(
                    not any(said), f"says that a robot at {tuple(pose)} has reached {tuple(GOAL.pose)} ± 0.25 m, rad"
                )

    @promise
    def a_heading_is_compared_around_the_circle(self) -> None:
        """Given a heading that differs by a whole turn then it is the same heading."""
        turned = Pose2(GOAL.pose.x, GOAL.pose.y, GOAL.pose.yaw - 2 * math.pi)
        require(self.looked(self.built(), turned)[-1], "takes a heading for another one after a whole turn")

    @promise
    def a_reset_forgets_the_goal_before(self) -> None:
        """Given a goal that was reached and a reset then nothing of it counts for the next one."""
        checker, away = self.built(), Pose2(GOAL.pose.x + 1.0, GOAL.pose.y, GOAL.pose.yaw)
        self.looked(checker, GOAL.pose)
        require(not any(self.looked(checker, away)), "says that a goal is reached because the one before was")

    @promise
    def a_pose_that_is_no_number_reaches_nothing(self) -> None:
        """Given a pose of nan then the goal is not reached."""
        for pose in (Pose2(math.nan, math.nan, math.nan), Pose2(GOAL.pose.x, GOAL.pose.y, math.nan)):
            require(not any(self.looked(self.built(), pose)), f"says that a robot at {tuple(pose)} is there")

    @promise
    def the_same_calls_give_the_same_answers(self) -> None:
        """Given the same calls then the same answers: no clock, no chance."""
        near = Pose2(GOAL.pose.x + 0.15, GOAL.pose.y, GOAL.pose.yaw + 0.15)
        answers = [[self.looked(self.built(), near, twist) for twist in MOTIONS] for _ in range(2)]
        require(answers[0] == answers[1], "two checkers that are asked the same answer differently")
