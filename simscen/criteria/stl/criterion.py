"""Base of the temporal criteria: from a condition over signals to a verdict, its margin and the deciding moment."""

from __future__ import annotations

import math
from abc import abstractmethod
from typing import TYPE_CHECKING

from simscen.core.records.evidence import Evidence
from simscen.core.records.verdict import Finding, Status
from simscen.criteria.base import Criterion
from simscen.criteria.clearance import SEARCH_MARGIN_M
from simscen.criteria.findings import undecided
from simscen.criteria.stl import description
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


class TemporalCriterion(Criterion):
    """A criterion made of comparisons of named signals."""

    @abstractmethod
    def compared(self) -> list[Condition]:
        """Return all comparisons, in the order in which they are written."""

    @abstractmethod
    def formula(self) -> str:
        """Return the condition in words."""

    @abstractmethod
    def evaluate(self, context: EvaluationContext) -> Robustness:
        """Return the robustness of the condition on a run."""

    @property
    def clearance_range(self) -> float:
        """The largest bound on the clearance plus a margin, in meters."""
        bounds = [one.value for one in self.compared() if one.signal == "clearance" and one.value is not None]
        return max((bound + SEARCH_MARGIN_M for bound in bounds), default=0.0)

    @property
    def evidence(self) -> frozenset[Evidence]:
        """What a log must hold: the evidence of every signal that is compared."""
        compared = self.compared()
        objects = {Evidence.OBJECTS} if any(one.object is not None for one in compared) else set()
        return frozenset(objects).union(*(signal_evidence(one.signal) for one in compared if one.signal is not None))

    def judge(self, trace: Trace, case: Case) -> list[Finding]:
        """Return the verdict at the first sample, with the moment that decides it."""
        formula = self.formula()
        try:
            result = self.evaluate(EvaluationContext(trace, case, has_ended(trace)))
        except SignalUnavailable as missing:
            return [undecided("", str(missing), formula)]
        low, high = float(result.low[0]), float(result.high[0])
        if low > 0:
            return [self._decided(trace, result, "low", low)]
        if high < 0:
            return [self._decided(trace, result, "high", high)]
        untested = next(result.untested(), None)
        if untested is not None:
            return [_untested(untested, formula, optional=untested is result)]
        ended = f"the run ended at t = {trace.seconds(trace.end):.2f} s ({end_reason(trace)})"
        return [undecided("", f"{ended} before `{formula}` was decided", formula)]

    def _decided(self, trace: Trace, result: Robustness, bound: Bound, value: float) -> Finding:
        witness = result.witness(0, bound)
        tick = int(trace.truth.ticks[witness.sample])
        signal, unit, margin = witness.comparison.definition, _margin_unit(self.compared()), None
        if unit is None or math.isinf(value):
            unit = signal.unit
        else:
            margin = 0.0 if value == TIE_MARGIN else value  # a tie that does not hold keeps its negative sign
        return Finding(
            status=Status.PASS if bound == "low" else Status.FAIL,
            what=description.describe_signal(witness.comparison),
            measured=description.describe_value(witness),
            limit=description.describe_limit(witness),
            margin=margin,
            unit=unit,
            value=None if signal.is_boolean else witness.value,
            tick=tick,
            place=trace.place(tick),
            detail=_detail(trace, self.formula(), witness),
        )


def _untested(response: ResponseRobustness, formula: str, optional: bool) -> Finding:
    """Return the finding of a condition that passes only because a premise never held."""
    premise = description.describe(response.condition)
    if response.may_have_held:
        because = f"the run ended before it was known whether `{premise}` held, so nothing was tested"
    else:
        because = f"`{premise}` never held, so nothing was tested"
    return undecided("", because, formula, ["`required: false` lets such a run pass"] if optional else [])


def _detail(trace: Trace, formula: str, witness: Witness) -> tuple[str, ...]:
    times = [(what, trace.seconds(int(trace.truth.ticks[sample]))) for what, sample in witness.notes]
    return (f"asked: {formula}", *(f"{what} at t = {seconds:.2f} s" for what, seconds in times))


def _margin_unit(compared: list[Condition]) -> str | None:
    """Return the unit of the margin: the signals' own, "" for scales, None if signals differ in their units."""
    measured = [one for one in compared if not one.definition.is_boolean]
    if measured and all(one.scale is not None for one in measured):
        return ""
    units = {one.definition.unit for one in measured}
    return units.pop() if len(units) == 1 and all(one.scale is None for one in measured) else None
