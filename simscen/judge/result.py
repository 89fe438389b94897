"""Sums up a run that came to its end."""

from collections import Counter
from collections.abc import Mapping

from simscen.core.case import Case
from simscen.core.result import Outcome, RunFailure, RunKey, RunResult
from simscen.core.trace import Trace
from simscen.core.verdict import Status, Verdict
from simscen.criteria.bounds import BrokenTrace
from simscen.criteria.moments import ending
from simscen.judge.judge import outcome
from simscen.judge.metrics import measure


def run_result(
    scenario: str,
    path: str,
    seed: int,
    verdicts: tuple[Verdict, ...],
    trace: Trace,
    case: Case,
    *,
    variation: str = "",
    lines: tuple[int, ...] = (),
) -> RunResult:
    """Sum up a run that came to its end: `scenario` is the id, `path` the file as the user would write it."""
    came_out = outcome(verdicts)
    failure = _why(verdicts) if came_out is Outcome.ERROR else None
    metrics: Mapping[str, float | None] = {}
    try:
        metrics = measure(trace, case)
    except BrokenTrace as broken:  # whatever the criteria looked at, a run with such a signal is no run
        came_out, failure = Outcome.ERROR, failure or RunFailure("invalid", str(broken))
    return RunResult(
        key=RunKey(scenario, seed, variation),
        path=path,
        outcome=came_out,
        verdicts=verdicts,
        lines=lines,
        metrics=metrics,
        events=dict(sorted(Counter(str(event.kind) for event in trace.events).items())),
        ended=ending(trace),
        simulated=trace.seconds(trace.end),
        tick_rate=trace.tick_rate,
        error=failure,
    )


def _why(verdicts: tuple[Verdict, ...]) -> RunFailure:
    broken = [f"{v.id}: {v.tightest.measured}" for v in verdicts if v.status is Status.ERROR and v.tightest]
    return RunFailure("invalid", "; ".join(broken) or "nothing judged this run")
