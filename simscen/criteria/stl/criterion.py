"""Base class of the temporal criteria, which check a condition on signals over time (signal temporal logic)."""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from simscen.core.records.verdict import Evidence, Finding, Status
from simscen.criteria.base import Criterion
from simscen.criteria.clearance import SEARCH_MARGIN_M
from simscen.criteria.findings import MissingEvidence, undecided
from simscen.criteria.stl.condition import Condition, decision_horizon
from simscen.criteria.stl.description import describe, describe_limit, describe_signal, describe_value
from simscen.criteria.stl.evaluation import EvaluationContext, robustness
from simscen.criteria.stl.robustness import TIE_MARGIN, Bound, ResponseRobustness, Robustness
from simscen.criteria.timeline import end_reason, has_ended
from simscen.criteria.trace_signals.catalog import signal_evidence

if TYPE_CHECKING:
    from simscen.core.records.case import Case
    from simscen.core.records.trace import Trace


class TemporalCriterion(Criterion):
    """Criterion that a condition is true at the start of the run. Its temporal operators cover later times."""

    @property
    @abstractmethod
    def condition(self) -> Condition:
        """The condition that must be true at the start of the run."""

    @property
    def horizon(self) -> float:
        """Simulated time in s before which the criterion cannot pass."""
        return decision_horizon(self.condition)

    @property
    def clearance_range(self) -> float:
        """Distance in m around the robot up to which clearance must be measured; 0 if clearance is not compared."""
        bounds = [each.value for each in self.condition.comparisons() if each.signal == "clearance"]
        return max((bound + SEARCH_MARGIN_M for bound in bounds if bound is not None), default=0.0)

    @property
    def evidence(self) -> frozenset[Evidence]:
        """Evidence that the log must contain for the compared signals."""
        comparisons = list(self.condition.comparisons())
        objects = {Evidence.OBJECTS} if any(each.object is not None for each in comparisons) else set()
        signals = [each.signal for each in comparisons if each.signal is not None]
        return frozenset(objects).union(*map(signal_evidence, signals))

    def judge(self, trace: Trace, case: Case) -> list[Finding]:
        """Return one finding, with the value of the signal at the sample that decides the condition."""
        condition = self.condition
        formula = describe(condition)
        try:
            result = robustness(condition, EvaluationContext(trace, case, has_ended(trace)))
        except MissingEvidence as missing:
            return [undecided("", str(missing), formula)]
        low, high = float(result.low[0]), float(result.high[0])
        if low > 0:
            return [self._decisive_finding(trace, result, "low", low)]
        if high < 0:
            return [self._decisive_finding(trace, result, "high", high)]
        untested = next(result.untested_responses(), None)
        if untested is not None:
            return [_untested_finding(untested, formula, with_hint=untested is result)]
        ended = f"the run ended at t = {trace.seconds(trace.end):.2f} s ({end_reason(trace)})"
        because = f"{ended} before `{formula}` was decided"
        return [undecided("", because, formula, list(dict.fromkeys(_unknown_signals(trace, result))))]

    def _decisive_finding(self, trace: Trace, result: Robustness, bound: Bound, value: float) -> Finding:
        """Return the finding of a decided condition. `value` is its robustness: `bound` of `result` at the start."""
        witness = result.witness(0, bound)
        times = [(text, trace.seconds(int(trace.truth.ticks[sample]))) for text, sample in witness.notes]
        notes = [f"{text} at t = {seconds:.2f} s" for text, seconds in times]
        tick = int(trace.truth.ticks[witness.sample])
        signal, unit, margin = witness.comparison.definition, _margin_unit(list(self.condition.comparisons())), None
        if unit is None or math.isinf(value):
            unit = signal.unit
        else:
            margin = 0.0 if value == TIE_MARGIN else value  # a violated tie keeps its negative sign
        return Finding(
            status=Status.PASS if bound == "low" else Status.FAIL,
            what=describe_signal(witness.comparison),
            measured=describe_value(witness),
            limit=describe_limit(witness),
            margin=margin,
            unit=unit,
            value=None if signal.is_boolean or witness.comparison.scale is not None else witness.value,
            tick=tick,
            place=trace.place(tick),
            detail=(f"condition: {describe(self.condition)}", *notes),
        )


def _unknown_signals(trace: Trace, result: Robustness) -> Iterator[str]:
    """Yield a line for each comparison with a signal that is unknown at the beginning of the run."""
    for part in result.comparisons():
        unknown = np.flatnonzero(np.isnan(part.values))
        if len(unknown):
            end = trace.seconds(int(trace.truth.ticks[unknown[-1]]))
            yield f"{describe_signal(part.comparison)} is unknown up to t = {end:.2f} s: there was no belief yet"


def _untested_finding(response: ResponseRobustness, formula: str, with_hint: bool) -> Finding:
    """Return the inconclusive finding for a `whenever` if its premise was never true.

    If `with_hint`, the finding mentions the key `required`.
    """
    premise = describe(response.premise_condition)
    if response.may_be_tested:
        because = f"the run ended before it was known whether `{premise}` was true, so nothing was tested"
    else:
        because = f"`{premise}` was never true, so nothing was tested"
    return undecided("", because, formula, ["`required: false` lets such a run pass"] if with_hint else [])


def _margin_unit(comparisons: list[Condition]) -> str | None:
    """Return the unit of all compared numeric signals; "" if all have a `scale`, None without a common unit."""
    numeric = [each for each in comparisons if not each.definition.is_boolean]
    if numeric and all(each.scale is not None for each in numeric):
        return ""
    units = {each.definition.unit for each in numeric}
    return units.pop() if len(units) == 1 and all(each.scale is None for each in numeric) else None
