"""Robustness of a condition at each sample of a run: the margin by which it is true; negative if it is false.

The robustness of a comparison is the distance of its signal from the limit; infinite for a yes-or-no signal.
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
from simscen.criteria.stl.operators import Continuation, SampleWindows
from simscen.criteria.trace_signals.catalog import read_signal
from simscen.criteria.trace_signals.sampling import usual_period

if TYPE_CHECKING:
    from simscen.core.records.case import Case
    from simscen.core.records.trace import Trace

TIE_MARGIN = sys.float_info.min
"""Magnitude of the robustness if a signal equals its limit. The sign is positive for `>=` and `<=`."""

HOLD_VIOLATED, RESPONSE_DUE = "`hold` was false", "the response was due"
"""Texts in `Witness.notes`."""

Bound = Literal["low", "high"]
"""Lower or upper bound of the robustness."""


@dataclass(frozen=True)
class Witness:
    """Comparison that decides the robustness of a condition.

    `sample` is the index of the decisive sample. `value` is the value of the signal at this sample. `negated` is True
    if the comparison is below a `not`. `notes` contains texts about other samples, with their indices.
    """

    comparison: Condition
    sample: int
    value: float
    negated: bool = False
    notes: tuple[tuple[str, int], ...] = ()

    def with_note(self, what: str, sample: int) -> Witness:
        """Return a copy with the note `what` about a sample in front of the other notes."""
        return replace(self, notes=((what, sample), *self.notes))


@dataclass(frozen=True, eq=False)
class Robustness:
    """Lower and upper bound (n,) of the robustness of a condition at each sample.

    The bounds differ where something is unknown, such as the time after the last sample. A condition is decided at a
    sample if both bounds have the same sign, and certainly true if both are positive. Each operator has a subclass.
    """

    low: Array
    high: Array

    def bound(self, bound: Bound) -> Array:
        """Return the array of a bound."""
        return self.low if bound == "low" else self.high

    def witness(self, sample: int, bound: Bound) -> Witness:
        """Return the comparison that decides a bound at a sample. The condition must be decided there."""
        raise NotImplementedError

    def parts(self) -> Sequence[Robustness]:
        """Return the robustness of each operand."""
        return ()

    def untested_responses(self) -> Iterator[ResponseRobustness]:
        """Yield each `whenever` in the condition if its premise is required, but was never certainly true."""
        for part in self.parts():
            yield from part.untested_responses()


@dataclass(frozen=True, eq=False)
class _ComparisonRobustness(Robustness):
    """Robustness of a comparison. `values` (n,) are the values of its signal."""

    comparison: Condition
    values: Array

    def witness(self, sample: int, bound: Bound) -> Witness:
        return Witness(self.comparison, sample, float(self.values[sample]))


@dataclass(frozen=True, eq=False)
class _NegationRobustness(Robustness):
    """Robustness of `not`."""

    part: Robustness

    def witness(self, sample: int, bound: Bound) -> Witness:
        found = self.part.witness(sample, "high" if bound == "low" else "low")
        return replace(found, negated=not found.negated)

    def parts(self) -> Sequence[Robustness]:
        return (self.part,)


@dataclass(frozen=True, eq=False)
class _BooleanRobustness(Robustness):
    """Robustness of `all` or `any`."""

    operands: Sequence[Robustness]

    def witness(self, sample: int, bound: Bound) -> Witness:
        decides = next(part for part in self.operands if part.bound(bound)[sample] == self.bound(bound)[sample])
        return decides.witness(sample, bound)

    def parts(self) -> Sequence[Robustness]:
        return self.operands


@dataclass(frozen=True, eq=False)
class _WindowRobustness(Robustness):
    """Robustness of `always` or `eventually`."""

    part: Robustness
    windows: SampleWindows

    def witness(self, sample: int, bound: Bound) -> Witness:
        at = _first_equal(self.part.bound(bound), self.bound(bound)[sample], sample, self.windows)
        return self.part.witness(at, bound)

    def parts(self) -> Sequence[Robustness]:
        return (self.part,)


@dataclass(frozen=True, eq=False)
class _UntilRobustness(Robustness):
    """Robustness of `until`."""

    hold: Robustness
    release: Robustness
    windows: SampleWindows

    def witness(self, sample: int, bound: Bound) -> Witness:
        """Return the witness of `release` at its best sample, or of `hold` if a sample before has lower robustness."""
        end = int(self.windows.last[sample]) + 1
        first = int(self.windows.first[sample]) - sample
        hold, release = self.hold.bound(bound)[sample:end], self.release.bound(bound)[sample:end]
        before = np.concatenate(([math.inf], np.minimum.accumulate(hold)[:-1]))
        best = np.minimum(before, release)
        value = float(self.bound(bound)[sample])
        at = first + int(np.argmax(best[first:])) if first < len(best) else len(best)
        if at < len(best) and best[at] != value:  # a release after the run would be better, but `hold` was false before
            at = len(best)
        if at < len(best) and release[at] <= before[at]:
            decides = self.release.witness(sample + at, bound)
        else:
            decides = self.hold.witness(sample + int(np.argmin(hold[:at])), bound)
        false_samples = np.flatnonzero(np.signbit(hold))
        is_violated = np.signbit(value) and len(false_samples)
        return decides.with_note(HOLD_VIOLATED, sample + int(false_samples[0])) if is_violated else decides

    def parts(self) -> Sequence[Robustness]:
        return (self.hold, self.release)


@dataclass(frozen=True, eq=False)
class ResponseRobustness(Robustness):
    """Robustness of `whenever … then`: at all samples of a window, the premise is false or the response is true.

    `implication` is the robustness of "the premise is false or the response is true". `premise_samples` are the samples
    at which the premise is checked. If `required`, the condition cannot pass unless the premise was certainly true at
    one of these samples.
    """

    premise: Robustness
    response: Robustness
    implication: Robustness
    windows: SampleWindows
    premise_condition: Condition
    premise_samples: slice
    required: bool

    @property
    def was_tested(self) -> bool:
        """Whether the premise was certainly true at a sample."""
        return bool((self.premise.low[self.premise_samples] > 0).any())

    @property
    def may_be_tested(self) -> bool:
        """Whether the premise was true at a sample, or may have been true if the run had continued."""
        return bool((self.premise.high[self.premise_samples] > 0).any())

    def witness(self, sample: int, bound: Bound) -> Witness:
        """Return the witness of the worst response, with a note on the sample at which its premise was true."""
        at = _first_equal(self.implication.bound(bound), self.bound(bound)[sample], sample, self.windows)
        return self.implication.witness(at, bound).with_note(RESPONSE_DUE, at)

    def parts(self) -> Sequence[Robustness]:
        """Return the robustness of premise and response."""
        return (self.premise, self.response)

    def untested_responses(self) -> Iterator[ResponseRobustness]:
        """Yield this `whenever`, and each nested one, if its premise is required, but was never certainly true."""
        if self.required and not self.was_tested:
            yield self
        yield from super().untested_responses()


@dataclass(frozen=True, eq=False)
class EvaluationContext:
    """Run on which conditions are evaluated, at each sample of the truth. `run_ended` is False for a truncated log."""

    trace: Trace
    case: Case
    run_ended: bool

    @cached_property
    def period(self) -> int:
        """Median spacing of samples in ticks."""
        return usual_period(self.trace.truth.ticks)

    def sample_windows(self, window: Window) -> SampleWindows:
        """Return the window of each sample. Raises InvalidTrace if windows are too short to contain a sample."""
        start, end = window.interval
        rate, last = self.trace.tick_rate, None
        if end is not None:
            last = round(end * rate)
            first_sample, last_sample = -(-round(start * rate) // self.period), last // self.period
            if last_sample < max(first_sample, 1):
                spacing = self.trace.seconds(self.period)
                raise InvalidTrace(
                    f"the window up to {end:g} s ahead contains no sample: samples are {spacing:g} s apart"
                )
        return SampleWindows.of_samples(self.trace.truth.ticks, self.period, round(start * rate), last)

    @cached_property
    def rest_of_run(self) -> SampleWindows:
        """Windows from each sample to the end of the run."""
        return SampleWindows.of_samples(self.trace.truth.ticks, self.period, 0, None)


def robustness(condition: Condition, context: EvaluationContext, begin: int = 0) -> Robustness:
    """Return the robustness of a condition at each sample.

    The premise of a `whenever` is checked from sample `begin` on. Raises SignalUnavailable if the trace lacks a signal,
    and InvalidTrace if a signal is not finite.
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
    """Return the robustness of "always (or eventually) `condition`" in a window. For `begin`, see `robustness`."""
    windows = context.sample_windows(window)
    return _apply_windows(operator, robustness(condition, context, _start(windows, begin)), windows, context)


def until_robustness(
    hold: Condition, release: Condition, window: Window, context: EvaluationContext, begin: int = 0
) -> Robustness:
    """Return the robustness of "`hold` until `release`" with the release in `window`. For `begin`, see `robustness`."""
    windows = context.sample_windows(window)
    holds, releases = robustness(hold, context, begin), robustness(release, context, _start(windows, begin))
    low, high = (
        operators.until(holds.bound(bound), releases.bound(bound), windows, continuation)
        for bound, continuation in _continuations(context)
    )
    return _UntilRobustness(low, high, holds, releases, windows)


def response_robustness(
    premise: Condition,
    response: Condition,
    window: Window | None,
    context: EvaluationContext,
    begin: int = 0,
    required: bool = True,
) -> ResponseRobustness:
    """Return the robustness of "whenever `premise`, then `response`" in a window. For `begin`, see `robustness`.

    A window of None is the rest of the run. If `required` and the premise was never certainly true, `low` is -inf.
    """
    windows = context.rest_of_run if window is None else context.sample_windows(window)
    start = _start(windows, begin)
    premise_part, response_part = robustness(premise, context, start), robustness(response, context, start)
    negated = _NegationRobustness(-premise_part.high, -premise_part.low, premise_part)
    implication = _combine([negated, response_part], "any")
    always = _apply_windows("always", implication, windows, context)
    end = int(windows.last[begin]) + 1 if begin < len(windows.last) else None
    found = ResponseRobustness(
        always.low, always.high, premise_part, response_part, implication, windows, premise, slice(start, end), required
    )
    return replace(found, low=np.full_like(found.low, -math.inf)) if required and not found.was_tested else found


def _apply_windows(
    operator: Literal["always", "eventually"], part: Robustness, windows: SampleWindows, context: EvaluationContext
) -> Robustness:
    """Return the robustness of `always` or `eventually` with the robustness of its operand."""
    evaluate = operators.always if operator == "always" else operators.eventually
    low, high = (evaluate(part.bound(bound), windows, continuation) for bound, continuation in _continuations(context))
    return _WindowRobustness(low, high, part, windows)


def _start(windows: SampleWindows, begin: int) -> int:
    """Return the index of the first sample in the window of sample `begin`; the number of samples if there is none."""
    return int(windows.first[begin]) if begin < len(windows.first) else len(windows.first)


def _continuations(context: EvaluationContext) -> list[tuple[Bound, Continuation]]:
    """Return each bound with its assumption about the time after the last sample."""
    return [("low", Continuation(-math.inf, context.run_ended)), ("high", Continuation(math.inf, context.run_ended))]


def _combine(parts: Sequence[Robustness], operator: Literal["all", "any"]) -> Robustness:
    """Return the robustness of `all` or `any` with the robustness of its operands."""
    extremum = np.minimum if operator == "all" else np.maximum
    low, high = reduce(extremum, [part.low for part in parts]), reduce(extremum, [part.high for part in parts])
    return _BooleanRobustness(low, high, parts)


def _compare(condition: Condition, context: EvaluationContext) -> Robustness:
    """Return the robustness of a comparison."""
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
    # Clearance is measured up to a maximum range; beyond it, the true distance may have any larger value.
    farther = _distances(condition, np.where(values >= context.case.clearance_range, math.inf, values))
    return _ComparisonRobustness(np.minimum(distances, farther), np.maximum(distances, farther), condition, values)


def _distances(condition: Condition, values: Array) -> Array:
    """Return the signed distances of a signal from its limit, divided by `condition.scale`."""
    assert condition.value is not None
    above = condition.op in (">=", ">")
    distances = (values - condition.value if above else condition.value - values) / (condition.scale or 1.0)
    tie = TIE_MARGIN if condition.op in (">=", "<=") else -TIE_MARGIN
    signed: Array = np.where(values == condition.value, tie, distances)
    return signed


def _first_equal(values: Array, value: float, sample: int, windows: SampleWindows) -> int:
    """Return the first sample in the window of `sample` at which `values` has the given value."""
    begin = int(windows.first[sample])
    return begin + int(np.argmax(values[begin:] == value))
