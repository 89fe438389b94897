"""Goal checkers, each of which breaks a promise."""

import random

from simscen.model.controllers import SimpleGoalChecker
from tests.contracts.broken.cases import Wrapper, breaks

CHECKER = SimpleGoalChecker()


class CheckerWrapper(Wrapper):
    def reached(self, goal, pose, twist):
        return self.inner.reached(goal, pose, twist)


@breaks(CHECKER, "a robot that stands", "does not say")
class NeverReached(CheckerWrapper):
    def reached(self, *arguments):
        return False


@breaks(CHECKER, "outside the tolerances", "says that a robot at")
class IgnoresTolerance(CheckerWrapper):
    def reached(self, goal, pose, twist):
        return goal.pose.distance(pose) < 1.0


@breaks(CHECKER, "outside the tolerances", "says that a robot at")
class IgnoresHeading(CheckerWrapper):
    def reached(self, goal, pose, twist):
        return goal.pose.distance(pose) <= goal.xy_tolerance


@breaks(CHECKER, "a heading is compared", "after a whole turn")
class ComparesUnwrappedYaw(CheckerWrapper):
    def reached(self, goal, pose, twist):
        return goal.pose.distance(pose) <= 0.25 and abs(goal.pose.yaw - pose.yaw) <= 0.25


@breaks(CHECKER, "a reset forgets", "because the previous one was")
class IgnoresReset(CheckerWrapper):
    was_reached = False

    def reset(self):
        pass

    def reached(self, *arguments):
        self.was_reached = self.was_reached or self.inner.reached(*arguments)
        return self.was_reached


@breaks(CHECKER, "a pose that is no number", "has reached the goal")
class AcceptsNan(CheckerWrapper):
    def reached(self, goal, pose, twist):
        return not (goal.pose.distance(pose) > 0.25 or abs(goal.pose.yaw - pose.yaw) > 0.25)


@breaks(CHECKER, "the same calls", "answer the same calls differently")
class UsesGlobalRandom(CheckerWrapper):
    def reached(self, *arguments):
        return self.inner.reached(*arguments) and random.random() < 0.9


@breaks(CHECKER, "a robot that stands", "answers 'yes'")
class ReturnsString(CheckerWrapper):
    def reached(self, *arguments):
        return "yes" if self.inner.reached(*arguments) else "no"
