"""The result of one run, and result.json: no wall clock, host or process in it, so that it can be compared."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from simscen.core.case import Case
from simscen.core.session import Outcome, RunFailure, RunKey
from simscen.core.trace import Trace
from simscen.core.verdict import Verdict
from simscen.criteria.criterion import AnyCriterion
from simscen.criteria.moments import ending
from simscen.judge.judging import judge, outcome
from simscen.judge.metrics import measure


@dataclass(frozen=True)
class RunResult:
    """All that a run says about itself.

    `path` and `lines` are where the scenario and each of its criteria are written. `events` counts what happened, by
    kind. `simulated` is in seconds. `again` is the command that repeats the run. `error` is set exactly when the
    outcome is ERROR.
    """

    key: RunKey
    path: str
    outcome: Outcome
    verdicts: tuple[Verdict, ...] = ()
    lines: tuple[int, ...] = ()
    metrics: Mapping[str, float | None] = field(default_factory=dict)
    events: Mapping[str, int] = field(default_factory=dict)
    ended: str = ""
    simulated: float = 0.0
    tick_rate: int = 240
    again: str = ""
    error: RunFailure | None = None


def conclude(
    key: RunKey,
    path: str,
    criteria: Sequence[AnyCriterion],
    trace: Trace,
    case: Case,
    lines: tuple[int, ...] = (),
    again: str = "",
) -> RunResult:
    """Judge a trace and sum it up."""
    verdicts = judge(criteria, trace, case)
    verdict = outcome(verdicts)
    return RunResult(
        key=key,
        path=path,
        outcome=verdict,
        verdicts=verdicts,
        lines=lines,
        metrics=_measured(trace, case, verdict),
        events=dict(sorted(Counter(event.kind for event in trace.events).items())),
        ended=ending(trace),
        simulated=trace.seconds(trace.end),
        tick_rate=trace.tick_rate,
        again=again,
        error=_why(verdicts) if verdict is Outcome.ERROR else None,
    )


def _measured(trace: Trace, case: Case, verdict: Outcome) -> Mapping[str, float | None]:
    """A trace that broke a criterion may break the metrics too; that run is an error already."""
    try:
        return measure(trace, case)
    except ValueError:
        if verdict is not Outcome.ERROR:
            raise
        return {}


def _why(verdicts: tuple[Verdict, ...]) -> RunFailure:
    broken = [f"{v.id}: {v.tightest.measured}" for v in verdicts if v.status.value == "error" and v.tightest]
    return RunFailure("invalid", "; ".join(broken) or "nothing judged this run")
