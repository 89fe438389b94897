"""Contract of goal checkers: checks that every goal checker must pass."""

from __future__ import annotations

import math

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import STOP, Twist
from simscen.core.messages.goals import Goal
from simscen.stack.protocols import GoalChecker
from simscen.testing.contracts.base import ComponentContract, call_component, promise, require

GOAL = Goal("g", Pose2(2.0, -1.0, 0.5), xy_tolerance=0.25, yaw_tolerance=0.25)
CALL_COUNT = 40
"""Number of calls of a goal checker in 2 s at 20 Hz."""
VELOCITIES = (STOP, Twist(0.3), Twist(0.0, 0.0, 0.8), Twist(-0.2, 0.0, -0.4))
"""Velocities of the robot in calls of goal checkers."""


class GoalCheckerContract(ComponentContract):
    """Contract of a goal checker, for poses at GOAL, outside the tolerances of GOAL, and far away."""

    role = "goal_checker"

    def answers_at(self, checker: GoalChecker, pose: Pose2, twist: Twist = STOP) -> list[bool]:
        """Reset the checker, and return its answers for a robot that keeps this pose and velocity for 2 s."""
        call_component("is reset", checker.reset)
        answers = [
            call_component("checks a pose", lambda: checker.reached(GOAL, pose, twist)) for _ in range(CALL_COUNT)
        ]
        require(all(each in (True, False) for each in answers), f"answers {answers[0]!r}")
        return answers

    @promise
    def a_robot_that_stands_on_the_goal_has_reached_it_within_two_seconds(self) -> None:
        """Given a robot that stands at the goal then the goal is reached within two seconds."""
        is_reached = self.answers_at(self.build(), GOAL.pose)[-1]
        require(is_reached, "does not say that a robot that stands at the goal has reached it")

    @promise
    def outside_the_tolerances_no_goal_is_reached(self) -> None:
        """Given a robot outside a tolerance of the goal, standing or moving, then the goal is not reached."""
        x, y, yaw = GOAL.pose
        for dx, dy, turn in ((0.26, 0.0, 0.0), (0.0, -0.5, 0.0), (0.0, 0.0, 0.26), (0.0, 0.0, math.pi)):
            pose = Pose2(x + dx, y + dy, yaw + turn)
            for twist in VELOCITIES:
                answers = self.answers_at(self.build(), pose, twist)
                observation = f"says that a robot at {tuple(pose)} has reached {tuple(GOAL.pose)} ± 0.25 m, rad"
                require(not any(answers), observation)

    @promise
    def a_heading_is_compared_around_the_circle(self) -> None:
        """Given a yaw that differs from the goal's yaw by a whole turn then the goal is reached."""
        turned = GOAL.pose._replace(yaw=GOAL.pose.yaw - 2 * math.pi)
        require(
            self.answers_at(self.build(), turned)[-1], "treats the goal's heading as another one after a whole turn"
        )

    @promise
    def a_reset_forgets_the_goal_before(self) -> None:
        """Given a reached goal and a reset then the goal is not reached from far away."""
        checker, away = self.build(), Pose2(GOAL.pose.x + 1.0, GOAL.pose.y, GOAL.pose.yaw)
        self.answers_at(checker, GOAL.pose)
        require(not any(self.answers_at(checker, away)), "says that a goal is reached because the previous one was")

    @promise
    def a_pose_that_is_no_number_reaches_nothing(self) -> None:
        """Given a pose of nan then the goal is not reached."""
        for pose in (Pose2(math.nan, math.nan, math.nan), Pose2(GOAL.pose.x, GOAL.pose.y, math.nan)):
            require(
                not any(self.answers_at(self.build(), pose)), f"says that a robot at {tuple(pose)} has reached the goal"
            )

    @promise
    def the_same_calls_give_the_same_answers(self) -> None:
        """Given the same calls then the answers are the same, independent of clocks and global random generators."""
        near = Pose2(GOAL.pose.x + 0.15, GOAL.pose.y, GOAL.pose.yaw + 0.15)
        answers = [[self.answers_at(self.build(), near, twist) for twist in VELOCITIES] for _ in range(2)]
        require(answers[0] == answers[1], "two checkers answer the same calls differently")
