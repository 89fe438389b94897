"""Base class of the temporal criteria: finds out whether a condition on signals is met, by which margin, and when."""

from __future__ import annotations

import math
from abc import abstractmethod
from typing import TYPE_CHECKING

from simscen.core.records.verdict import Evidence, Finding, Status
from simscen.criteria.base import Criterion
from simscen.criteria.clearance import SEARCH_MARGIN_M
from simscen.criteria.findings import undecided
from simscen.criteria.stl.description import describe, describe_limit, describe_signal, describe_value
from simscen.criteria.stl.robustness import (
    TIE_MARGIN,
    Bound,
    EvaluationContext,
    ResponseRobustness,
    Robustness,
    Witness,
)
from simscen.criteria.timeline import end_reason, has_ended
from simscen.criteria.trace_signals.catalog import signal_evidence
from simscen.criteria.trace_signals.sampling import SignalUnavailable

if TYPE_CHECKING:
    from simscen.core.records.case import Case
    from simscen.core.records.trace import Trace
    from simscen.criteria.stl.condition import Condition
    from simscen.criteria.stl.robustness import Witness


class TemporalCriterion(Criterion):
    """Criterion that consists of a condition on named signals."""

    @abstractmethod
    def compared(self) -> list[Condition]:
        """Return all comparisons in the condition, in the order of the operands."""

    @abstractmethod
    def formula(self) -> str:
        """Return the condition in words."""

    @abstractmethod
    def evaluate(self, context: EvaluationContext) -> Robustness:
        """Return the robustness of the condition on a run."""

    @property
    def clearance_range(self) -> float:
        """Distance in m around the robot up to which clearance must be measured: beyond all bounds on the clearance."""
        bounds = [one.value for one in self.compared() if one.signal == "clearance" and one.value is not None]
        return max((bound + SEARCH_MARGIN_M for bound in bounds), default=0.0)

    @property
    def evidence(self) -> frozenset[Evidence]:
        """Evidence that the criterion needs from the log: that of all compared signals."""
        compared = self.compared()
        objects = {Evidence.OBJECTS} if any(one.object is not None for one in compared) else set()
        return frozenset(objects).union(*(signal_evidence(one.signal) for one in compared if one.signal is not None))

    def judge(self, trace: Trace, case: Case) -> list[Finding]:
        """Return one finding: whether the condition is true at the start of the run, and the sample that decides."""
        formula = self.formula()
        try:
            result = self.evaluate(EvaluationContext(trace, case, has_ended(trace)))
        except SignalUnavailable as missing:
            return [undecided("", str(missing), formula)]
        low, high = float(result.low[0]), float(result.high[0])
        if low > 0:
            return [self._decisive_finding(trace, result, "low", low)]
        if high < 0:
            return [self._decisive_finding(trace, result, "high", high)]
        untested = next(result.untested(), None)
        if untested is not None:
            return [_untested_finding(untested, formula, optional=untested is result)]
        ended = f"the run ended at t = {trace.seconds(trace.end):.2f} s ({end_reason(trace)})"
        return [undecided("", f"{ended} before `{formula}` was decided", formula)]

    def _decisive_finding(self, trace: Trace, result: Robustness, bound: Bound, value: float) -> Finding:
        witness = result.witness(0, bound)
        tick = int(trace.truth.ticks[witness.sample])
        signal, unit, margin = witness.comparison.definition, _margin_unit(self.compared()), None
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
            value=None if signal.is_boolean else witness.value,
            tick=tick,
            place=trace.place(tick),
            detail=_detail(trace, self.formula(), witness),
        )


def _untested_finding(response: ResponseRobustness, formula: str, optional: bool) -> Finding:
    """Return the inconclusive finding for a `whenever` whose premise was never true.

    If `optional`, it has a line about the key `required`, which only the criterion itself has, not a nested `whenever`.
    """
    premise = describe(response.premise_condition)
    if response.may_have_held:
        because = f"the run ended before it was known whether `{premise}` was true, so nothing was tested"
    else:
        because = f"`{premise}` was never true, so nothing was tested"
    return undecided("", because, formula, ["`required: false` lets such a run pass"] if optional else [])


def _detail(trace: Trace, formula: str, witness: Witness) -> tuple[str, ...]:
    times = [(what, trace.seconds(int(trace.truth.ticks[sample]))) for what, sample in witness.notes]
    return (f"condition: {formula}", *(f"{what} at t = {seconds:.2f} s" for what, seconds in times))


def _margin_unit(compared: list[Condition]) -> str | None:
    """Return the unit of the margin: that of all compared signals, or "" if all have scales; None if units differ."""
    measured = [one for one in compared if not one.definition.is_boolean]
    if measured and all(one.scale is not None for one in measured):
        return ""
    units = {one.definition.unit for one in measured}
    return units.pop() if len(units) == 1 and all(one.scale is None for one in measured) else None
