"""Robustness of a condition on a run: how well it holds at each sample, and which moment decides that.

The robustness of a comparison is the distance of its signal to the bound, positive where the comparison holds. Where
signal and bound are equal, it is the smallest number with the right sign, so that `>=` and `>` differ and the sign
alone is the verdict. A yes-or-no signal is infinitely far from its bound: it decides, and leaves the margin to others.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, reduce
from typing import TYPE_CHECKING, Literal

import numpy as np

from simscen.core.geometry import Array
from simscen.criteria.findings import InvalidTrace
from simscen.criteria.stl import operators
from simscen.criteria.stl.condition import Condition, Window
from simscen.criteria.stl.operators import Continuation, SampleWindow
from simscen.criteria.trace_signals.catalog import read_signal
from simscen.criteria.trace_signals.sampling import usual_period

if TYPE_CHECKING:
    from simscen.core.records.case import Case
    from simscen.core.records.trace import Trace

TIE_MARGIN = sys.float_info.min
"""Robustness of a signal that equals its bound, with the sign of the verdict."""

BROKEN, DUE = "what had to hold until then was broken", "the answer was due"

Bound = Literal["low", "high"]


@dataclass(frozen=True)
class Witness:
    """The comparison that decides, the sample at which it does, and the signal there; `negated` below a `not`.

    `notes` name other samples that explain the verdict.
    """

    comparison: Condition
    sample: int
    value: float
    negated: bool = False
    notes: tuple[tuple[str, int], ...] = ()

    def with_note(self, what: str, sample: int) -> Witness:
        """Return a copy with one more note in front."""
        return replace(self, notes=((what, sample), *self.notes))


@dataclass(frozen=True, eq=False)
class Robustness:
    """Interval of the robustness at each sample, over all ways in which the run could have gone on.

    `low` assumes that what is not known is as bad as can be, `high` as good as can be. The verdict is known where both
    have the same sign.
    """

    low: Array
    high: Array

    def bound(self, bound: Bound) -> Array:
        """Return `low` or `high`."""
        return self.low if bound == "low" else self.high

    def witness(self, sample: int, bound: Bound) -> Witness:
        """Return what decides the value at a sample where it is known."""
        raise NotImplementedError

    def parts(self) -> Sequence[Robustness]:
        """Return the robustness of each operand."""
        return ()

    def untested(self) -> Iterator[ResponseRobustness]:
        """Yield each `whenever` in it whose premise never held."""
        for part in self.parts():
            yield from part.untested()


@dataclass(frozen=True, eq=False)
class _ComparisonRobustness(Robustness):
    comparison: Condition
    values: Array

    def witness(self, sample: int, bound: Bound) -> Witness:
        return Witness(self.comparison, sample, float(self.values[sample]))


@dataclass(frozen=True, eq=False)
class _NegationRobustness(Robustness):
    part: Robustness

    def witness(self, sample: int, bound: Bound) -> Witness:
        found = self.part.witness(sample, "high" if bound == "low" else "low")
        return replace(found, negated=not found.negated)

    def parts(self) -> Sequence[Robustness]:
        return (self.part,)


@dataclass(frozen=True, eq=False)
class _BooleanRobustness(Robustness):
    operands: Sequence[Robustness]

    def witness(self, sample: int, bound: Bound) -> Witness:
        decides = next(part for part in self.operands if part.bound(bound)[sample] == self.bound(bound)[sample])
        return decides.witness(sample, bound)

    def parts(self) -> Sequence[Robustness]:
        return self.operands


@dataclass(frozen=True, eq=False)
class _WindowRobustness(Robustness):
    """Robustness of `always` or `eventually`: the first sample of the window with its value decides."""

    part: Robustness
    window: SampleWindow

    def witness(self, sample: int, bound: Bound) -> Witness:
        at = _first_equal(self.part.bound(bound), self.bound(bound)[sample], sample, self.window)
        return self.part.witness(at, bound)

    def parts(self) -> Sequence[Robustness]:
        return (self.part,)


@dataclass(frozen=True, eq=False)
class _UntilRobustness(Robustness):
    hold: Robustness
    release: Robustness
    window: SampleWindow

    def witness(self, sample: int, bound: Bound) -> Witness:
        """Return the best release, or what breaks the hold before it."""
        end = int(self.window.last[sample]) + 1
        first = int(self.window.first[sample]) - sample
        hold, release = self.hold.bound(bound)[sample:end], self.release.bound(bound)[sample:end]
        before = np.concatenate(([math.inf], np.minimum.accumulate(hold)[:-1]))
        best = np.minimum(before, release)
        value = float(self.bound(bound)[sample])
        at = first + int(np.argmax(best[first:])) if first < len(best) else len(best)
        if at < len(best) and best[at] != value:  # a release after the run would be better, but `hold` was broken
            at = len(best)
        if at < len(best) and release[at] <= before[at]:
            decides = self.release.witness(sample + at, bound)
        else:
            decides = self.hold.witness(sample + int(np.argmin(hold[:at])), bound)
        broken = np.flatnonzero(np.signbit(hold))
        violated = np.signbit(value) and len(broken)
        return decides.with_note(BROKEN, sample + int(broken[0])) if violated else decides

    def parts(self) -> Sequence[Robustness]:
        return (self.hold, self.release)


@dataclass(frozen=True, eq=False)
class ResponseRobustness(Robustness):
    """Robustness of `whenever … then`: always, the premise does not hold or the answer does.

    `reach` is the slice of samples at which the premise counts. A response whose premise never surely held there has
    tested nothing: it does not pass, unless `required` is False.
    """

    premise: Robustness
    answer: Robustness
    implied: Robustness
    window: SampleWindow
    condition: Condition
    reach: slice
    required: bool

    @property
    def tested(self) -> bool:
        """True if the premise surely held at some sample."""
        return bool((self.premise.low[self.reach] > 0).any())

    @property
    def may_have_held(self) -> bool:
        """True if the premise may have held at some sample, depending on how the run would have gone on."""
        return bool((self.premise.high[self.reach] > 0).any())

    def witness(self, sample: int, bound: Bound) -> Witness:
        """Return what decides the worst answer, and when it was due."""
        at = _first_equal(self.implied.bound(bound), self.bound(bound)[sample], sample, self.window)
        return self.implied.witness(at, bound).with_note(DUE, at)

    def parts(self) -> Sequence[Robustness]:
        """Return premise and answer."""
        return (self.premise, self.answer)

    def untested(self) -> Iterator[ResponseRobustness]:
        """Yield itself and each nested `whenever` whose premise never surely held."""
        if self.required and not self.tested:
            yield self
        yield from super().untested()


@dataclass(frozen=True, eq=False)
class EvaluationContext:
    """A run on which conditions are evaluated: at each sample of the truth, whenever that was.

    `over` says that the run came to its end; a truncated log did not.
    """

    trace: Trace
    case: Case
    over: bool

    @cached_property
    def period(self) -> int:
        """The usual spacing of samples in ticks: the median."""
        return usual_period(self.trace.truth.ticks)

    def window(self, window: Window) -> SampleWindow:
        """Return a window as ranges of samples. Raises InvalidTrace if it is shorter than the spacing of samples."""
        start, end = window.interval
        rate, last = self.trace.tick_rate, None
        if end is not None:
            last = round(end * rate)
            first_sample, last_sample = -(-round(start * rate) // self.period), last // self.period
            if last_sample < max(first_sample, 1):
                spacing = self.trace.seconds(self.period)
                raise InvalidTrace(f"the window up to {end:g} s ahead holds no sample: they are {spacing:g} s apart")
        return SampleWindow.over(self.trace.truth.ticks, self.period, round(start * rate), last)

    @cached_property
    def rest_of_run(self) -> SampleWindow:
        """From each sample to the end of the run."""
        return SampleWindow.over(self.trace.truth.ticks, self.period, 0, None)


def robustness(condition: Condition, context: EvaluationContext, begin: int = 0) -> Robustness:
    """Return the robustness of a condition at each sample.

    `begin` is the first sample at which it counts. Raises SignalUnavailable or InvalidTrace for its signals.
    """
    if condition.signal is not None:
        return _compare(condition, context)
    if condition.not_ is not None:
        part = robustness(condition.not_, context, begin)
        return _NegationRobustness(-part.high, -part.low, part)
    if condition.all is not None:
        return _combine([robustness(part, context, begin) for part in condition.all], "all")
    if condition.any is not None:
        return _combine([robustness(part, context, begin) for part in condition.any], "any")
    if condition.always is not None:
        return windowed_robustness("always", condition.always, condition.always, context, begin)
    if condition.eventually is not None:
        return windowed_robustness("eventually", condition.eventually, condition.eventually, context, begin)
    if condition.until is not None:
        until = condition.until
        return until_robustness(until.hold, until.release, until, context, begin)
    assert condition.whenever is not None and condition.then is not None
    return response_robustness(condition.whenever, condition.then, None, context, begin)


def windowed_robustness(
    operator: Literal["always", "eventually"],
    condition: Condition,
    window: Window,
    context: EvaluationContext,
    begin: int = 0,
) -> Robustness:
    """Return the robustness of `condition` always or eventually in a window."""
    samples = context.window(window)
    return _windowed(operator, robustness(condition, context, _start(samples, begin)), samples, context)


def until_robustness(
    hold: Condition, release: Condition, window: Window, context: EvaluationContext, begin: int = 0
) -> Robustness:
    """Return the robustness of `hold` until `release` in a window."""
    samples = context.window(window)
    holds, releases = robustness(hold, context, begin), robustness(release, context, _start(samples, begin))
    low, high = (
        operators.until(holds.bound(bound), releases.bound(bound), samples, ahead)
        for bound, ahead in _continuations(context)
    )
    return _UntilRobustness(low, high, holds, releases, samples)


def response_robustness(
    premise: Condition,
    answer: Condition,
    window: Window | None,
    context: EvaluationContext,
    begin: int = 0,
    required: bool = True,
) -> ResponseRobustness:
    """Return the robustness of: whenever `premise` holds in the window, `answer` does.

    If the premise never surely holds although it is `required` to, `low` is -inf: then nothing was tested.
    """
    samples = context.rest_of_run if window is None else context.window(window)
    start = _start(samples, begin)
    held, answered = robustness(premise, context, start), robustness(answer, context, start)
    implied = _combine([_NegationRobustness(-held.high, -held.low, held), answered], "any")
    always = _windowed("always", implied, samples, context)
    # A nested response is evaluated at every later sample as well; one at the start of the run only there.
    end = None if window is None or samples.unbounded or not len(samples.last) else int(samples.last[begin]) + 1
    found = ResponseRobustness(
        always.low, always.high, held, answered, implied, samples, premise, slice(start, end), required
    )
    return replace(found, low=np.full_like(found.low, -math.inf)) if required and not found.tested else found


def _windowed(
    operator: Literal["always", "eventually"], part: Robustness, window: SampleWindow, context: EvaluationContext
) -> Robustness:
    over = operators.always if operator == "always" else operators.eventually
    low, high = (over(part.bound(bound), window, ahead) for bound, ahead in _continuations(context))
    return _WindowRobustness(low, high, part, window)


def _start(window: SampleWindow, begin: int) -> int:
    """Return the first sample of the window of sample `begin`; beyond the run it is the number of samples."""
    return int(window.first[begin]) if begin < len(window.first) else len(window.first)


def _continuations(context: EvaluationContext) -> list[tuple[Bound, Continuation]]:
    return [("low", Continuation(-math.inf, context.over)), ("high", Continuation(math.inf, context.over))]


def _combine(parts: Sequence[Robustness], how: Literal["all", "any"]) -> Robustness:
    pick = np.minimum if how == "all" else np.maximum
    low, high = reduce(pick, [part.low for part in parts]), reduce(pick, [part.high for part in parts])
    return _BooleanRobustness(low, high, parts)


def _compare(condition: Condition, context: EvaluationContext) -> Robustness:
    assert condition.signal is not None
    trace = context.trace
    values = read_signal(condition.signal, trace, context.case, condition.arguments)
    if np.isnan(values).any():
        at = trace.seconds(int(trace.truth.ticks[int(np.argmax(np.isnan(values)))]))
        raise InvalidTrace(f"{condition.signal} is not a number at t = {at:.2f} s")
    if condition.definition.is_boolean:
        certain = np.where(values, math.inf, -math.inf)
        return _ComparisonRobustness(certain, certain, condition, values)
    distances = _distances(condition, values)
    if condition.signal != "clearance":
        return _ComparisonRobustness(distances, distances, condition, values)
    # Clearance was searched only to a range; beyond it, the true distance may be anything larger.
    farther = _distances(condition, np.where(values >= context.case.clearance_range, math.inf, values))
    return _ComparisonRobustness(np.minimum(distances, farther), np.maximum(distances, farther), condition, values)


def _distances(condition: Condition, values: Array) -> Array:
    """Return the distances to the bound, divided by `scale` if given; positive where the comparison holds."""
    assert condition.value is not None
    above = condition.op in (">=", ">")
    distances = (values - condition.value if above else condition.value - values) / (condition.scale or 1.0)
    tie = TIE_MARGIN if condition.op in (">=", "<=") else -TIE_MARGIN
    signed: Array = np.where(values == condition.value, tie, distances)
    return signed


def _first_equal(values: Array, wanted: float, sample: int, window: SampleWindow) -> int:
    """Return the first sample of the window of `sample` with a value that occurs in it."""
    begin = int(window.first[sample])
    return begin + int(np.argmax(values[begin:] == wanted))
