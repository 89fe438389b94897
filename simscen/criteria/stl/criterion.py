"""How a temporal formula becomes a finding: verdict, margin, and the moment that decided."""

from __future__ import annotations

import math
from abc import abstractmethod
from typing import TYPE_CHECKING

from simscen.core.evidence import Evidence
from simscen.core.verdict import Finding, Status
from simscen.criteria.base import Criterion
from simscen.criteria.clearance import SEARCH_MARGIN_M
from simscen.criteria.findings import undecided
from simscen.criteria.stl import description
from simscen.criteria.stl.robustness import TIE_MARGIN, Bound, EvaluationContext, Robustness, Witness
from simscen.criteria.timeline import end_reason, has_ended
from simscen.criteria.trace_signals.catalog import signal_evidence
from simscen.criteria.trace_signals.readers import SignalUnavailable

if TYPE_CHECKING:
    from collections.abc import Callable

    from simscen.core.case import Case
    from simscen.core.trace import Trace
    from simscen.criteria.stl.condition import Condition


class TemporalCriterion(Criterion):
    """A criterion made of comparisons of named signals."""

    @abstractmethod
    def compared(self) -> list[Condition]:
        """All of them, in the order they are written."""

    @property
    def clearance_range(self) -> float:
        """The largest bound on the clearance, and a little more."""
        bounds = [one.value for one in self.compared() if one.signal == "clearance" and one.value is not None]
        return max((bound + SEARCH_MARGIN_M for bound in bounds), default=0.0)

    @property
    def evidence(self) -> frozenset[Evidence]:
        """What a log must hold for it to be decided."""
        compared = self.compared()
        things = {Evidence.OBJECTS} if any(one.object is not None for one in compared) else set()
        return frozenset(things).union(*(signal_evidence(one.signal) for one in compared if one.signal is not None))


def temporal_finding(
    trace: Trace, case: Case, told: str, compared: list[Condition], judge: Callable[[EvaluationContext], Robustness]
) -> Finding:
    """The verdict at the first sample. `told` is the formula in words, `judge` evaluates it."""
    try:
        answer = judge(EvaluationContext.of(trace, case, has_ended(trace)))
    except SignalUnavailable as missing:
        return undecided("", str(missing), told)
    low, high = float(answer.low[0]), float(answer.high[0])
    if low > 0:
        return _decided(trace, told, compared, answer, "low", low)
    if high < 0:
        return _decided(trace, told, compared, answer, "high", high)
    ended = f"the run ended at t = {trace.seconds(trace.end):.2f} s ({end_reason(trace)})"
    return undecided("", f"{ended} before `{told}` was decided", told)


def _decided(
    trace: Trace, told: str, compared: list[Condition], answer: Robustness, side: Bound, value: float
) -> Finding:
    witness = answer.witness(0, side)
    tick = int(trace.truth.ticks[witness.sample])
    signal, unit, margin = witness.comparison.measured, _unit(compared), None
    if unit is None or math.isinf(value):
        unit = signal.unit
    else:
        margin = _margin(value)
    return Finding(
        status=Status.PASS if side == "low" else Status.FAIL,
        what=description.describe_signal(witness.comparison),
        measured=description.describe_value(witness),
        limit=description.describe_limit(witness),
        margin=margin,
        unit=unit,
        value=None if signal.asks else witness.value,
        tick=tick,
        place=trace.place(tick),
        detail=_detail(trace, told, witness),
    )


def _margin(value: float) -> float:
    """A tie that holds has a margin of zero; one that does not keeps its sign."""
    return 0.0 if value == TIE_MARGIN else value


def _detail(trace: Trace, told: str, witness: Witness) -> tuple[str, ...]:
    times = [(what, trace.seconds(int(trace.truth.ticks[sample]))) for what, sample in witness.notes]
    return (f"asked: {told}", *(f"{what} at t = {seconds:.2f} s" for what, seconds in times))


def _unit(compared: list[Condition]) -> str | None:
    """The unit of the margin: the signals' own, "" for scales, None where metres would be compared with seconds."""
    measured = [one for one in compared if not one.measured.asks]
    if measured and all(one.scale is not None for one in measured):
        return ""
    units = {one.measured.unit for one in measured}
    return units.pop() if len(units) == 1 and all(one.scale is None for one in measured) else None
