"""`path_length`: how far the robot drove."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from pydantic import model_validator

from simscen.core.records.events import EventKind
from simscen.core.records.evidence import Evidence
from simscen.core.records.verdict import Finding
from simscen.criteria.base import Criterion
from simscen.criteria.findings import at_most, undecided
from simscen.criteria.goal_outcomes import goal_outcomes
from simscen.criteria.trace_signals.ground_truth import Drive, drive
from simscen.spec.base import Spec
from simscen.spec.quantities import PositiveLength, Ratio

if TYPE_CHECKING:
    from simscen.core.records.case import Case
    from simscen.core.records.trace import Trace


class PathLength(Spec, Criterion):
    """The robot drove no further than it should.

    What is measured: the length of the true way in the plane, in moves of at least 1 cm, over the whole run; its ratio
        to the shortest way from the start through all goals that a disc of the robot's inscribed radius has; goals at
        which the robot is to fail are left out of that way.
    When it fails: it is longer than `max`, or than `max_ratio` times the shortest way.
    Why this: detours, swerving and search patterns cost battery and nerves while every goal is still reached.
    Source: HuNavSim and bench-mr for the length; SEAN's "path efficiency" is this ratio. SPL (Anderson 2018) is its
        inverse over many runs.

    Example: `path_length: {max_ratio: 1.4}`
    """

    max: PositiveLength | None = None
    """Meters."""
    max_ratio: Ratio | None = None
    """Times the shortest way; 1 is a perfect drive."""

    @model_validator(mode="after")
    def _some_bound(self) -> PathLength:
        if self.max is None and self.max_ratio is None:
            raise ValueError("expected max or max_ratio")
        return self

    @property
    def evidence(self) -> frozenset[Evidence]:
        """What a log must hold for it to be decided."""
        return frozenset({Evidence.TRUTH})

    def judge(self, trace: Trace, case: Case) -> list[Finding]:
        """The length, then the ratio; both in meters of margin."""
        way = drive(trace)
        findings = [] if self.max is None else [_bound(trace, way, "path_length", self.max)]
        if self.max_ratio is not None:
            findings.append(self._ratio(trace, case, way))
        return findings

    def _ratio(self, trace: Trace, case: Case, way: Drive) -> Finding:
        assert self.max_ratio is not None
        what = "path_length ratio"
        shortest, because = shortest_way(trace, case)
        if because:
            return undecided(what, because, f"≤ {self.max_ratio:g}")
        limit = self.max_ratio * shortest
        context = f"({self.max_ratio:g} times the shortest way of {shortest:.2f} m)"
        unreached = [
            outcome for outcome in goal_outcomes(trace, case) if outcome.reached is None and not outcome.failure
        ]
        if unreached and way.length <= limit:
            name = unreached[0].goal.name
            return undecided(what, f"goal {name} was not reached, so there is no whole way to compare", context)
        return _bound(trace, way, what, limit, context)


def shortest_way(trace: Trace, case: Case) -> tuple[float, str]:
    """The length in meters of the shortest way through all goals; or nan, and why there is none to compare with."""
    names = [goal.name for goal in case.goals if goal.name not in case.expected]
    twice = sorted({name for name in names if names.count(name) > 1})
    without = [name for name in names if not math.isfinite(case.shortest.get(name, math.nan))]
    length = sum(case.shortest.get(name, math.nan) for name in names)
    sent = trace.of_kind(EventKind.GOAL_ACCEPTED)
    on_the_way = sorted({event.name for event in sent} & {goal.name for goal in case.sent})
    if on_the_way:
        return math.nan, f"{', '.join(on_the_way)} was sent on the way, from where nobody could know before"
    if twice:
        return math.nan, f"several goals are called {', '.join(twice)}: their shortest ways cannot be told apart"
    if without:
        return math.nan, f"no shortest way to {', '.join(without)} is known"
    return (length, "") if length > 0 else (math.nan, "the shortest way has no length")


def _bound(trace: Trace, way: Drive, what: str, limit: float, context: str = "") -> Finding:
    over = int(np.argmax(way.travelled > limit)) if way.length > limit else len(way.ticks) - 1
    at = (trace, int(way.ticks[over])) if len(way.ticks) else None
    return at_most(what, way.length, limit, "m", at=at, context=context)
