"""Criteria, faults, triggers, actions and metrics, each of which breaks a promise."""

import math
import random
from collections.abc import Callable
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np

from simscen.actions.base import Action
from simscen.core.records.verdict import Finding, Status
from simscen.core.stage import Effect
from simscen.criteria.base import Criterion, Measure
from simscen.faults.base import Fault, FaultEffect
from simscen.spec.base import Spec
from simscen.testing.contracts.sensors_and_faults import FAULT_READING_COUNT, READINGS
from simscen.triggers.base import Condition
from tests.contracts.broken.cases import COUNT, breaks_contract

# criteria

PASSING = Finding(Status.PASS, "it", "0", "≤ 1", margin=1.0)


@breaks_contract("every trace yields", "returns no finding for")
class ReturnsNoFinding(Spec, Criterion):
    def judge(self, trace, case):
        return []


@breaks_contract("every trace yields", "raises IndexError when it judges the trace of a stationary robot: index")
class RequiresBelief(Spec, Criterion):
    def judge(self, trace, case):
        trace.belief.values[0]
        return [PASSING]


@breaks_contract("a margin has the sign", "pass with a margin of -1")
class PassesWithNegativeMargin(Spec, Criterion):
    def judge(self, trace, case):
        return [replace(PASSING, margin=-1.0)]


@breaks_contract("the same trace gives", "different findings for the same drive")
class CountsJudgments(Spec, Criterion):
    def judge(self, trace, case):
        return [replace(PASSING, measured=str(next(COUNT)))]


@breaks_contract("a trace is not changed", "changes the trace")
class CriterionChangesTrace(Spec, Criterion):
    def judge(self, trace, case):
        trace.truth.values[:] = 0.0
        return [PASSING]


@breaks_contract("a trace is not changed", "changes the trace")
class CriterionUnwrapsHeadings(Spec, Criterion):
    def judge(self, trace, case):
        trace.truth.values[:, 2] = np.unwrap(trace.truth.values[:, 2])
        return [PASSING]


@breaks_contract("a trace is not changed", "changes the trace")
class CriterionMovesStartToOrigin(Spec, Criterion):
    def judge(self, trace, case):
        trace.truth.values[:, :2] -= trace.truth.values[0, :2]
        return [PASSING]


@breaks_contract("its horizon", "has a horizon of nan")
class HasNanHorizon(Spec, Criterion):
    @property
    def horizon(self):
        return math.nan

    def judge(self, trace, case):
        return [PASSING]


# faults


class DisturbingEffect(FaultEffect):
    def __init__(self, change: Callable[[Any], Any]) -> None:
        self.reading = change  # type: ignore[method-assign]


class ScanFault(Spec, Fault):
    affects: ClassVar[frozenset[str]] = frozenset({"Scan"})

    def begin(self, rng, wheels):
        return DisturbingEffect(self.change)

    def change(self, reading):
        return reading


@breaks_contract("it affects known targets", "which are not targets")
class AffectsUnknownTarget(ScanFault):
    affects: ClassVar[frozenset[str]] = frozenset({"Sonar"})


@breaks_contract("it affects known targets", "affects nothing")
class AffectsNothing(ScanFault):
    affects: ClassVar[frozenset[str]] = frozenset()


@breaks_contract("it returns the same type or none", "for a Scan")
class ChangesSensorName(ScanFault):
    def change(self, reading):
        return replace(reading, sensor="other")


@breaks_contract("the same generator", "for the same")
class FaultUsesGlobalRandom(ScanFault):
    def change(self, reading):
        return replace(reading, ranges=reading.ranges + random.random())


@breaks_contract("the same generator", "for the same")
class DelaysOneReadingMoreTheSecondTime(ScanFault):
    def begin(self, rng, wheels):
        work, number = FaultEffect(), FAULT_READING_COUNT - 1
        if next(COUNT) % 2:
            last = READINGS["Scan"](number)
            work.arriving_readings = lambda: [last] if wheels.now() == last.tick else []  # type: ignore[method-assign]
        return work


@breaks_contract("a reading is never changed", "changes the Scan")
class ChangesReading(ScanFault):
    def change(self, reading):
        reading.ranges[:] = 0.0
        return reading


@breaks_contract("its end leaves", "leaves 'dust'")
class ReturnsTextAtEnd(ScanFault):
    def begin(self, rng, wheels):
        work = FaultEffect()
        work.end = lambda: "dust"  # type: ignore[method-assign,assignment,return-value]
        return work


# triggers


@breaks_contract("it returns true or false at every moment", "raises AttributeError")
class RequiresGoal(Spec, Condition):
    def holds(self, now):
        return now.goal.pose.x > 0


@breaks_contract("it returns true or false at every moment", "answers 0")
class ReturnsNumber(Spec, Condition):
    def holds(self, now):
        return now.tick and 240


@breaks_contract("the same situation", "depend on earlier calls")
class CountsCallsOfTrigger(Spec, Condition):
    def holds(self, now):
        return next(COUNT) % 3 == 0


@breaks_contract("it changes nothing", "changes the world")
class TriggerChangesWorld(Spec, Condition):
    def holds(self, now):
        now.push((1.0, 0.0))
        return True


# actions


@breaks_contract("it returns an effect", "without a description")
class HasNoDescription(Spec, Action):
    def perform(self, stage):
        stage.push((1.0, 0.0))
        return Effect(True, "")


@breaks_contract("it returns an effect", "but did nothing")
class ReportsEffectWithoutOne(Spec, Action):
    def perform(self, stage):
        return Effect(True, "moved the earth")


@breaks_contract("the same stage gives the same calls", "different calls the second time")
class ActionUsesGlobalRandom(Spec, Action):
    def perform(self, stage):
        stage.push((random.random(), 0.0))
        return Effect(True, "pushed")


# metrics


@breaks_contract("it returns a finite number or a reason", "returns nan")
class ReturnsNan(Spec, Measure):
    def measure(self, trace, case):
        return math.nan


@breaks_contract("the same trace gives", "different numbers for the same drive")
class CountsMeasurements(Spec, Measure):
    def measure(self, trace, case):
        return float(next(COUNT))


@breaks_contract("a trace is not changed", "changes the trace")
class MetricChangesTrace(Spec, Measure):
    def measure(self, trace, case):
        trace.truth.values[:] = 0.0
        return 0.0


@breaks_contract("it has a unit and valid evidence", "has the unit 3")
class HasNoUnit(Spec, Measure):
    unit: ClassVar[Any] = 3

    def measure(self, trace, case):
        return 0.0
