"""Criteria, faults, triggers, actions and metrics that break a promise each."""

import math
import random
from collections.abc import Callable
from dataclasses import replace
from typing import Any, ClassVar

from simscen.actions.base import Action
from simscen.core.records.verdict import Finding, Status
from simscen.core.stage import Effect
from simscen.criteria.base import Criterion, Measure
from simscen.faults.base import Fault, FaultEffect
from simscen.spec.base import Spec
from simscen.triggers.base import Condition
from tests.contracts.broken.cases import COUNT, word

# criteria

FINE = Finding(Status.PASS, "it", "0", "≤ 1", margin=1.0)


@word("every trace yields", "returns no finding for")
class ChecksNothing(Spec, Criterion):
    def judge(self, trace, case):
        return []


@word("every trace yields", "raises IndexError when it judges the trace of a stationary robot")
class NeedsABelief(Spec, Criterion):
    def judge(self, trace, case):
        trace.belief.values[0]
        return [FINE]


@word("a margin has the sign", "pass with a margin of -1")
class PassesBelow(Spec, Criterion):
    def judge(self, trace, case):
        return [replace(FINE, margin=-1.0)]


@word("the same trace gives", "different findings for the same drive")
class Counts(Spec, Criterion):
    def judge(self, trace, case):
        return [replace(FINE, measured=str(next(COUNT)))]


@word("a trace is not changed", "changes the trace")
class SmoothesTheTrace(Spec, Criterion):
    def judge(self, trace, case):
        trace.truth.values[:] = 0.0
        return [FINE]


@word("its horizon", "has a horizon of nan")
class HasNoHorizon(Spec, Criterion):
    @property
    def horizon(self):
        return math.nan

    def judge(self, trace, case):
        return [FINE]


# faults


class Disturbing(FaultEffect):
    def __init__(self, change: Callable[[Any], Any]) -> None:
        self.reading = change  # type: ignore[method-assign]


class OnScans(Spec, Fault):
    affects: ClassVar[frozenset[str]] = frozenset({"Scan"})

    def begin(self, rng, wheels):
        return Disturbing(self.changed)

    def changed(self, reading):
        return reading


@word("it affects known targets", "which are not targets")
class AffectsGhosts(OnScans):
    affects: ClassVar[frozenset[str]] = frozenset({"Sonar"})


@word("it affects known targets", "affects nothing")
class AffectsNothing(OnScans):
    affects: ClassVar[frozenset[str]] = frozenset()


@word("it returns the same type or none", "for a Scan")
class AnswersForAnother(OnScans):
    def changed(self, reading):
        return replace(reading, sensor="other")


@word("the same generator", "for the same")
class IsUnsteady(OnScans):
    def changed(self, reading):
        return replace(reading, ranges=reading.ranges + random.random())


@word("a reading is never changed", "changes the Scan")
class WritesIntoTheReading(OnScans):
    def changed(self, reading):
        reading.ranges[:] = 0.0
        return reading


@word("its end leaves", "leaves 'dust'")
class LeavesDust(OnScans):
    def begin(self, rng, wheels):
        work = FaultEffect()
        work.end = lambda: "dust"  # type: ignore[method-assign,assignment,return-value]
        return work


# triggers


@word("it returns true or false at every moment", "raises AttributeError")
class NeedsAGoal(Spec, Condition):
    def holds(self, now):
        return now.goal.pose.x > 0


@word("it returns true or false at every moment", "answers 0")
class AnswersANumber(Spec, Condition):
    def holds(self, now):
        return now.tick and 240


@word("the same situation", "depend on earlier calls")
class HoldsEverySecondTime(Spec, Condition):
    def holds(self, now):
        return next(COUNT) % 3 == 0


@word("it changes nothing", "changes the world")
class Meddles(Spec, Condition):
    def holds(self, now):
        now.push((1.0, 0.0))
        return True


# actions


@word("it returns an effect", "without a description")
class SaysNothing(Spec, Action):
    def perform(self, stage):
        stage.push((1.0, 0.0))
        return Effect(True, "")


@word("it returns an effect", "but did nothing")
class Boasts(Spec, Action):
    def perform(self, stage):
        return Effect(True, "moved the earth")


@word("the same stage gives the same calls", "different calls the second time")
class ActsByChance(Spec, Action):
    def perform(self, stage):
        stage.push((random.random(), 0.0))
        return Effect(True, "pushed")


# metrics


@word("it returns a finite number or a reason", "returns nan")
class MeasuresNothing(Spec, Measure):
    def measure(self, trace, case):
        return math.nan


@word("the same trace gives", "different numbers for the same drive")
class CountsCalls(Spec, Measure):
    def measure(self, trace, case):
        return float(next(COUNT))


@word("a trace is not changed", "changes the trace")
class Resets(Spec, Measure):
    def measure(self, trace, case):
        trace.truth.values[:] = 0.0
        return 0.0


@word("it has a unit and valid evidence", "has the unit 3")
class HasNoUnit(Spec, Measure):
    unit: ClassVar[Any] = 3

    def measure(self, trace, case):
        return 0.0
