"""Evaluation of conditions in signal temporal logic (STL): their robustness at each sample of the ground truth."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, reduce
from typing import TYPE_CHECKING, Literal

import numpy as np

from simscen.core.geometry import Array
from simscen.criteria.findings import InvalidTrace
from simscen.criteria.stl import operators
from simscen.criteria.stl.condition import Condition, UntilOperands, Whenever, Window, WindowedCondition
from simscen.criteria.stl.operators import Continuation, SampleWindows
from simscen.criteria.stl.robustness import (
    TIE_MARGIN,
    BooleanRobustness,
    Bound,
    ComparisonRobustness,
    NegationRobustness,
    ResponseRobustness,
    Robustness,
    UntilRobustness,
    WindowRobustness,
)
from simscen.criteria.trace_signals.catalog import read_signal
from simscen.criteria.trace_signals.sampling import usual_period

if TYPE_CHECKING:
    from simscen.core.records.case import Case
    from simscen.core.records.trace import Trace

WindowOperator = Callable[[Array, SampleWindows, Continuation], Array]
"""Function `always` or `eventually` of the module `operators`."""


@dataclass(frozen=True, eq=False)
class EvaluationContext:
    """Run on which conditions are evaluated, at each sample of the ground truth.

    `run_ended` is True if the trace contains the end of the run, and False for a truncated log.
    """

    trace: Trace
    case: Case
    run_ended: bool

    @cached_property
    def period(self) -> int:
        """Median spacing of samples in ticks."""
        return usual_period(self.trace.truth.ticks)

    def sample_windows(self, window: Window) -> SampleWindows:
        """Return the window of each sample. Raises InvalidTrace if windows contain no later sample."""
        start, end = window.interval
        rate, last = self.trace.tick_rate, None
        if end is not None:
            last = round(end * rate)
            first_sample, last_sample = -(-round(start * rate) // self.period), last // self.period
            if last_sample < max(first_sample, 1):
                spacing = self.trace.seconds(self.period)
                raise InvalidTrace(
                    f"the window up to {end:g} s ahead contains no later sample: samples are {spacing:g} s apart"
                )
        return SampleWindows.of_samples(self.trace.truth.ticks, self.period, round(start * rate), last)


def robustness(condition: Condition, context: EvaluationContext, begin: int = 0) -> Robustness:
    """Return the robustness of a condition at each sample.

    `begin` is the sample at which the criterion is evaluated: a `whenever` counts as tested only if its premise is true
    in the window of this sample. Raises MissingEvidence if the trace lacks a signal, and InvalidTrace if a signal is
    not finite.
    """
    if condition.signal is not None:
        return _compare(condition, context)
    if condition.not_ is not None:
        part = robustness(condition.not_, context, begin)
        return NegationRobustness(-part.high, -part.low, [part])
    if condition.all is not None:
        return _combine([robustness(part, context, begin) for part in condition.all], "all")
    if condition.any is not None:
        return _combine([robustness(part, context, begin) for part in condition.any], "any")
    if condition.always is not None:
        return _windowed(operators.always, condition.always, context, begin)
    if condition.eventually is not None:
        return _windowed(operators.eventually, condition.eventually, context, begin)
    if condition.until is not None:
        return _until(condition.until, context, begin)
    assert condition.whenever is not None and condition.then is not None
    return _response(condition.whenever, condition.then, context, begin)


def _windowed(
    operator: WindowOperator, condition: WindowedCondition, context: EvaluationContext, begin: int
) -> Robustness:
    """Return the robustness of `always` or `eventually`. For `begin`, see `robustness`."""
    windows = context.sample_windows(condition)
    return _apply_windows(operator, robustness(condition, context, _first_sample(windows, begin)), windows, context)


def _until(condition: UntilOperands, context: EvaluationContext, begin: int) -> Robustness:
    """Return the robustness of `until`: `hold` is true until `release` is true. For `begin`, see `robustness`."""
    windows = context.sample_windows(condition)
    holds = robustness(condition.hold, context, begin)
    releases = robustness(condition.release, context, _first_sample(windows, begin))
    low, high = (
        operators.until(holds.bound(bound), releases.bound(bound), windows, continuation)
        for bound, continuation in _continuations(context)
    )
    return UntilRobustness(low, high, [holds, releases], windows)


def _response(premise: Condition, response: Condition, context: EvaluationContext, begin: int) -> ResponseRobustness:
    """Return the robustness of "whenever `premise`, then `response`". For `begin`, see `robustness`.

    The premise of a criterion (`Whenever`) has a window. For a nested `whenever`, the window is the rest of the run.
    `low` is -inf if the premise is required, but was never certainly true.
    """
    windows = context.sample_windows(premise if isinstance(premise, Whenever) else Window())
    is_required = premise.required if isinstance(premise, Whenever) else True
    start = _first_sample(windows, begin)
    premise_part, response_part = robustness(premise, context, start), robustness(response, context, start)
    negated = NegationRobustness(-premise_part.high, -premise_part.low, [premise_part])
    implication = _combine([negated, response_part], "any")
    always = _apply_windows(operators.always, implication, windows, context)
    end = int(windows.last[begin]) + 1 if begin < len(windows.last) else None
    found = ResponseRobustness(
        always.low,
        always.high,
        [premise_part, response_part],
        implication,
        windows,
        premise,
        slice(start, end),
        is_required,
    )
    return replace(found, low=np.full_like(found.low, -math.inf)) if is_required and not found.was_tested else found


def _apply_windows(
    operator: WindowOperator, part: Robustness, windows: SampleWindows, context: EvaluationContext
) -> Robustness:
    """Return the robustness of `always` or `eventually`, computed from the robustness of its operand."""
    low, high = (operator(part.bound(bound), windows, continuation) for bound, continuation in _continuations(context))
    return WindowRobustness(low, high, [part], windows)


def _first_sample(windows: SampleWindows, begin: int) -> int:
    """Return the index of the first sample in the window of sample `begin`; the number of samples if there is none."""
    return int(windows.first[begin]) if begin < len(windows.first) else len(windows.first)


def _continuations(context: EvaluationContext) -> list[tuple[Bound, Continuation]]:
    """Return each bound of the robustness with the assumption about the time after the last sample that leads to it."""
    return [("low", Continuation(-math.inf, context.run_ended)), ("high", Continuation(math.inf, context.run_ended))]


def _combine(parts: Sequence[Robustness], operator: Literal["all", "any"]) -> Robustness:
    """Return the robustness of `all` or `any`, computed from the robustness of its operands."""
    extremum = np.minimum if operator == "all" else np.maximum
    low, high = reduce(extremum, [part.low for part in parts]), reduce(extremum, [part.high for part in parts])
    return BooleanRobustness(low, high, parts)


def _compare(condition: Condition, context: EvaluationContext) -> Robustness:
    """Return the robustness of the comparison of a signal with a value; -inf to inf where the signal is unknown."""
    assert condition.signal is not None
    values = read_signal(condition.signal, context.trace, context.case, condition.arguments)
    if condition.definition.is_boolean:
        exact = np.where(values, math.inf, -math.inf)
        return ComparisonRobustness(exact, exact, (), condition, values)
    distances = _distances(condition, values)
    if condition.signal == "clearance":
        # Clearance is measured up to a maximum range. A value at this range stands for any larger distance.
        farther = _distances(condition, np.where(values >= context.case.clearance_range, math.inf, values))
        low, high = np.minimum(distances, farther), np.maximum(distances, farther)
    else:
        is_unknown = np.isnan(values)
        low, high = np.where(is_unknown, -math.inf, distances), np.where(is_unknown, math.inf, distances)
    return ComparisonRobustness(low, high, (), condition, values)


def _distances(condition: Condition, values: Array) -> Array:
    """Return the distances of a signal from its limit, divided by `condition.scale`; negative if it is violated."""
    assert condition.value is not None
    is_minimum = condition.op in (">=", ">")
    distances = (values - condition.value if is_minimum else condition.value - values) / (condition.scale or 1.0)
    tie = TIE_MARGIN if condition.op in (">=", "<=") else -TIE_MARGIN
    signed: Array = np.where(values == condition.value, tie, distances)
    return signed
