"""What a condition is worth on a run: how well it holds at each sample, and which moment decides that.

Every comparison becomes its distance to the bound, positive where it holds. Where the two are equal, the distance is
the smallest number with the right sign, so that `>=` and `>`, and with `not` also `<` and `<=`, keep their difference
and the sign alone is the verdict. Yes or no is infinitely far from its bound: it decides, and leaves the margin to
others.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import reduce
from typing import TYPE_CHECKING, Literal

import numpy as np

from simscen.core.geometry import Array
from simscen.criteria.findings import InvalidTrace
from simscen.criteria.stl import operators
from simscen.criteria.stl.condition import Condition, Window
from simscen.criteria.stl.operators import Continuation
from simscen.criteria.trace_signals.catalog import read_signal

if TYPE_CHECKING:
    from simscen.core.case import Case
    from simscen.core.trace import Trace

TIE_MARGIN = sys.float_info.min
"""Stands for a distance of zero, with the sign of the answer."""

BROKEN, DUE = "what had to hold until then was broken", "the answer was due"

Bound = Literal["low", "high"]


@dataclass(frozen=True)
class Witness:
    """The comparison that decides, the sample at which it does, and the signal there; `negated` below a `not`.

    `notes` are other samples that belong to the story, with what was there.
    """

    comparison: Condition
    sample: int
    value: float
    negated: bool = False
    notes: tuple[tuple[str, int], ...] = ()

    def noting(self, what: str, sample: int) -> Witness:
        """The same with one more note."""
        return replace(self, notes=((what, sample), *self.notes))


@dataclass(frozen=True, eq=False)
class Robustness:
    """How well a condition holds at each sample: from `low`, if what is not known is as bad as can be, to `high`."""

    low: Array
    high: Array

    def side(self, side: Bound) -> Array:
        """One of the two."""
        return self.low if side == "low" else self.high

    def witness(self, sample: int, side: Bound) -> Witness:
        """What decides the value at a sample that is known."""
        raise NotImplementedError


@dataclass(frozen=True, eq=False)
class _ComparisonRobustness(Robustness):
    comparison: Condition
    values: Array

    def witness(self, sample: int, side: Bound) -> Witness:
        return Witness(self.comparison, sample, float(self.values[sample]))


@dataclass(frozen=True, eq=False)
class _NegationRobustness(Robustness):
    part: Robustness

    def witness(self, sample: int, side: Bound) -> Witness:
        found = self.part.witness(sample, "high" if side == "low" else "low")
        return replace(found, negated=not found.negated)


@dataclass(frozen=True, eq=False)
class _BooleanRobustness(Robustness):
    parts: Sequence[Robustness]

    def witness(self, sample: int, side: Bound) -> Witness:
        decides = next(part for part in self.parts if part.side(side)[sample] == self.side(side)[sample])
        return decides.witness(sample, side)


@dataclass(frozen=True, eq=False)
class _WindowRobustness(Robustness):
    """Always or eventually: the first sample of the window that has the value decides."""

    part: Robustness
    window: operators.SampleWindow

    def witness(self, sample: int, side: Bound) -> Witness:
        return self.part.witness(_first(self.part.side(side), self.side(side)[sample], sample, self.window), side)


@dataclass(frozen=True, eq=False)
class _UntilRobustness(Robustness):
    hold: Robustness
    release: Robustness
    window: operators.SampleWindow

    def witness(self, sample: int, side: Bound) -> Witness:
        """The best release, or what breaks the hold before it."""
        held, freed = self.hold.side(side)[sample:], self.release.side(side)[sample:]
        before = np.concatenate(([math.inf], np.minimum.accumulate(held)[:-1]))
        best = np.minimum(before, freed)
        end = None if self.window.last is None else self.window.last + 1
        at = self.window.first + int(np.argmax(best[self.window.first : end]))
        if freed[at] <= before[at]:
            decides = self.release.witness(sample + at, side)
        else:
            decides = self.hold.witness(sample + int(np.argmin(held[:at])), side)
        broken = np.flatnonzero(np.signbit(held[:end]))
        return decides.noting(BROKEN, sample + int(broken[0])) if np.signbit(best[at]) and len(broken) else decides


@dataclass(frozen=True, eq=False)
class _ResponseRobustness(Robustness):
    """Always: the premise does not hold or the response does."""

    part: Robustness
    window: operators.SampleWindow

    def witness(self, sample: int, side: Bound) -> Witness:
        at = _first(self.part.side(side), self.side(side)[sample], sample, self.window)
        return self.part.witness(at, side).noting(DUE, at)


@dataclass(frozen=True, eq=False)
class EvaluationContext:
    """A run as formulas see it: samples of the truth, `period` ticks apart."""

    trace: Trace
    case: Case
    period: int
    over: bool

    @classmethod
    def of(cls, trace: Trace, case: Case, over: bool) -> EvaluationContext:
        """Raises InvalidTrace when the samples are not evenly spaced."""
        steps = np.diff(trace.truth.ticks)
        if len(steps) and (steps != steps[0]).any():
            at = trace.seconds(int(trace.truth.ticks[int(np.argmax(steps != steps[0]))]))
            raise InvalidTrace(f"the samples of the truth are not evenly spaced after t = {at:.2f} s")
        return cls(trace, case, int(steps[0]) if len(steps) else 1, over)

    def window(self, window: Window) -> operators.SampleWindow:
        """In samples. Raises InvalidTrace when there is none in it."""
        begin, end = window.stretch
        first = -(-round(begin * self.trace.tick_rate) // self.period)
        last = None if end is None else round(end * self.trace.tick_rate) // self.period
        if last is not None and last < max(first, 1):
            apart = self.trace.seconds(self.period)
            raise InvalidTrace(f"the window up to {end:g} s ahead holds no sample: they are {apart:g} s apart")
        return operators.SampleWindow(first, last)


def robustness(condition: Condition, scene: EvaluationContext) -> Robustness:
    """The value of a condition at each sample. Raises Unavailable or InvalidTrace for its signals."""
    if condition.signal is not None:
        return _compared(condition, scene)
    if condition.not_ is not None:
        part = robustness(condition.not_, scene)
        return _NegationRobustness(-part.high, -part.low, part)
    if condition.all is not None:
        return _combined([robustness(part, scene) for part in condition.all], "all")
    if condition.any is not None:
        return _combined([robustness(part, scene) for part in condition.any], "any")
    if condition.always is not None:
        return windowed_robustness(robustness(condition.always, scene), scene.window(condition.always), scene, "always")
    if condition.eventually is not None:
        return windowed_robustness(
            robustness(condition.eventually, scene), scene.window(condition.eventually), scene, "eventually"
        )
    if condition.until is not None:
        until = condition.until
        return until_robustness(
            robustness(until.hold, scene), robustness(until.release, scene), scene.window(until), scene
        )
    assert condition.whenever is not None and condition.then is not None
    return response_robustness(
        robustness(condition.whenever, scene), robustness(condition.then, scene), operators.SampleWindow(0, None), scene
    )


def windowed_robustness(
    part: Robustness,
    window: operators.SampleWindow,
    scene: EvaluationContext,
    operator: Literal["always", "eventually"],
) -> Robustness:
    """Always or eventually in a window."""
    over = operators.always if operator == "always" else operators.eventually
    low, high = (over(part.side(side), window, ahead) for side, ahead in _continuations(scene))
    return _WindowRobustness(low, high, part, window)


def until_robustness(
    hold: Robustness, release: Robustness, window: operators.SampleWindow, scene: EvaluationContext
) -> Robustness:
    """`hold` until `release` in a window."""
    sides = _continuations(scene)
    low, high = (operators.until(hold.side(side), release.side(side), window, ahead) for side, ahead in sides)
    return _UntilRobustness(low, high, hold, release, window)


def response_robustness(
    premise: Robustness, answer: Robustness, window: operators.SampleWindow, scene: EvaluationContext
) -> Robustness:
    """Whenever `premise` holds in the window, `answer` does."""
    implied = _combined([_NegationRobustness(-premise.high, -premise.low, premise), answer], "any")
    always = windowed_robustness(implied, window, scene, "always")
    return _ResponseRobustness(always.low, always.high, implied, window)


def _continuations(scene: EvaluationContext) -> list[tuple[Bound, Continuation]]:
    return [("low", Continuation(-math.inf, scene.over)), ("high", Continuation(math.inf, scene.over))]


def _combined(parts: Sequence[Robustness], how: Literal["all", "any"]) -> Robustness:
    pick = np.minimum if how == "all" else np.maximum
    low, high = reduce(pick, [part.low for part in parts]), reduce(pick, [part.high for part in parts])
    return _BooleanRobustness(low, high, parts)


def _compared(condition: Condition, scene: EvaluationContext) -> Robustness:
    assert condition.signal is not None
    values = read_signal(condition.signal, scene.trace, scene.case, condition.about)
    if np.isnan(values).any():
        at = scene.trace.seconds(int(scene.trace.truth.ticks[int(np.argmax(np.isnan(values)))]))
        raise InvalidTrace(f"{condition.signal} is not a number at t = {at:.2f} s")
    if condition.measured.asks:
        sure = np.where(values, math.inf, -math.inf)
        return _ComparisonRobustness(sure, sure, condition, values)
    distances = _distances(condition, values)
    if condition.signal != "clearance":
        return _ComparisonRobustness(distances, distances, condition, values)
    further = _distances(condition, np.where(values >= scene.case.clearance_range, math.inf, values))
    return _ComparisonRobustness(np.minimum(distances, further), np.maximum(distances, further), condition, values)


def _distances(condition: Condition, values: Array) -> Array:
    """To the bound, in scales where there is one; positive where the comparison holds."""
    assert condition.value is not None
    above = condition.op in (">=", ">")
    distances = (values - condition.value if above else condition.value - values) / (condition.scale or 1.0)
    tie = TIE_MARGIN if condition.op in (">=", "<=") else -TIE_MARGIN
    signed: Array = np.where(values == condition.value, tie, distances)
    return signed


def _first(values: Array, wanted: float, sample: int, window: operators.SampleWindow) -> int:
    """The first sample from the window's begin on that has a value; one in the window has it."""
    begin = sample + window.first
    return begin + int(np.argmax(values[begin:] == wanted))
