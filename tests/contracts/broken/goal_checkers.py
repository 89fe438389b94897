"""Goal checkers that break a promise each."""

import random

from simscen.model.controllers import SimpleGoalChecker
from tests.contracts.broken.cases import Wrapper, breaks

CHECKER = SimpleGoalChecker()


class Checking(Wrapper):
    def reached(self, goal, pose, twist):
        return self.inner.reached(goal, pose, twist)


@breaks(CHECKER, "a robot that stands", "does not say")
class IsNeverContent(Checking):
    def reached(self, *asked):
        return False


@breaks(CHECKER, "outside the tolerances", "says that a robot at")
class IsGenerous(Checking):
    def reached(self, goal, pose, twist):
        return goal.pose.distance(pose) < 1.0


@breaks(CHECKER, "outside the tolerances", "says that a robot at")
class MindsNoHeading(Checking):
    def reached(self, goal, pose, twist):
        return goal.pose.distance(pose) <= goal.xy_tolerance


@breaks(CHECKER, "a heading is compared", "after a whole turn")
class CountsTurns(Checking):
    def reached(self, goal, pose, twist):
        return goal.pose.distance(pose) <= 0.25 and abs(goal.pose.yaw - pose.yaw) <= 0.25


@breaks(CHECKER, "a reset forgets", "because the previous one was")
class StaysContent(Checking):
    content = False

    def reset(self):
        pass

    def reached(self, *asked):
        self.content = self.content or self.inner.reached(*asked)
        return self.content


@breaks(CHECKER, "a pose that is no number", "has reached the goal")
class ComparesTheWrongWay(Checking):
    def reached(self, goal, pose, twist):
        return not (goal.pose.distance(pose) > 0.25 or abs(goal.pose.yaw - pose.yaw) > 0.25)


@breaks(CHECKER, "the same calls", "answer the same calls differently")
class TossesACoin(Checking):
    def reached(self, *asked):
        return self.inner.reached(*asked) and random.random() < 0.9


@breaks(CHECKER, "a robot that stands", "answers 'yes'")
class AnswersInWords(Checking):
    def reached(self, *asked):
        return "yes" if self.inner.reached(*asked) else "no"
