"""Whole stacks, each of which breaks a promise."""

import random
from dataclasses import replace
from typing import Any

import numpy as np

from simscen.core.geometry.kinematics import Twist
from simscen.core.records.events import Event, EventKind
from simscen.core.records.trace import Decision
from simscen.model.localizers import GroundTruth
from simscen.model.stack import StackSpec
from tests.contracts.broken.cases import Wrapper, breaks

STACK = StackSpec(localizer=GroundTruth(type="ground_truth"))


class DecisionWrapper(Wrapper):
    tick = 0

    def decide(self, tick, readings):
        self.tick = tick
        return self.change(self.inner.decide(tick, readings))

    def change(self, decision: Decision) -> Any:
        return decision


@breaks(STACK, "it reaches a goal", "touches something")
class DrivesIntoObstacles(DecisionWrapper):
    def change(self, decision):
        is_early = self.tick < 1440
        return replace(decision, command=Twist(0.5, 0.0, 0.0) if is_early else decision.command)


@breaks(STACK, "it reaches a goal", "navigation ends with")
class NeverMoves(DecisionWrapper):
    def change(self, decision):
        return replace(decision, command=Twist())


@breaks(STACK, "without a goal", "commands a velocity without a goal")
class TurnsWithoutGoal(DecisionWrapper):
    def change(self, decision):
        return replace(decision, command=decision.command if any(decision.command) else Twist(0.0, 0.0, 0.01))


@breaks(STACK, "once a task has ended", "after the end of its task")
class DrivesAfterEnd(DecisionWrapper):
    has_ended = False

    def change(self, decision):
        self.has_ended = self.has_ended or any(event.kind == EventKind.NAVIGATION_ENDED for event in decision.events)
        return replace(decision, command=Twist(0.05)) if self.has_ended else decision


@breaks(STACK, "a canceled task", "does not report that its goal is canceled")
class HidesCancellation(DecisionWrapper):
    def change(self, decision):
        kept = tuple(event for event in decision.events if event.kind != EventKind.GOAL_CANCELED)
        return replace(decision, events=kept)


@breaks(STACK, "a canceled task", "commands a velocity after it was canceled")
class IgnoresCancel(DecisionWrapper):
    def cancel(self, tick):
        pass


@breaks(STACK, "a goal that preempts", "drives to")
class IgnoresPreemption(DecisionWrapper):
    def preempt(self, tick, goal):
        pass


@breaks(STACK, "every goal is accepted once", "accepts")
class AcceptsGoalTwice(DecisionWrapper):
    def change(self, decision):
        repeated = tuple(event for event in decision.events if event.kind == EventKind.GOAL_ACCEPTED)
        return replace(decision, events=decision.events + repeated)


@breaks(STACK, "the same seed", "differ in their commands")
class UsesGlobalRandom(DecisionWrapper):
    def change(self, decision):
        vx, vy, wz = decision.command
        return replace(decision, command=Twist(vx, vy, wz * (1 + 1e-12 * random.random()) + 1e-15 * random.random()))


@breaks(STACK, "without a goal", "the event goal.reached of tick -5")
class ReportsPastEvent(DecisionWrapper):
    def change(self, decision):
        return replace(decision, events=(Event(-5, EventKind.GOAL_REACHED, "x"),))


@breaks(STACK, "invalid scans never make a decision invalid", "raises ValueError when it decides")
class RejectsNanScan(DecisionWrapper):
    def decide(self, tick, readings):
        for reading in readings:
            if hasattr(reading, "ranges") and np.isnan(reading.ranges).any():
                raise ValueError("nan in the scan")
        return self.inner.decide(tick, readings)


@breaks(STACK, "it reaches a goal", "changes the ranges of a scan")
class ChangesScan(DecisionWrapper):
    def decide(self, tick, readings):
        for reading in readings:
            if hasattr(reading, "ranges"):
                reading.ranges[np.isinf(reading.ranges)] = 100.0
                reading.ranges[0] = 3.0
        return self.inner.decide(tick, readings)
