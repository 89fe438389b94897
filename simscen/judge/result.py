"""Judges a run that came to its end and sums it up."""

from collections import Counter
from collections.abc import Sequence

from simscen.core.case import Case
from simscen.core.evidence import WHOLE, Coverage
from simscen.core.expectation import Expectation
from simscen.core.result import Outcome, RunFailure, RunKey, RunResult
from simscen.core.trace import Trace
from simscen.core.verdict import Status, Verdict
from simscen.criteria.bounds import BrokenTrace
from simscen.criteria.criterion import AnyCriterion
from simscen.criteria.measure import AnyMeasure
from simscen.criteria.moments import ending, finished
from simscen.judge.disturbances import happenings, missing
from simscen.judge.expected import as_expected
from simscen.judge.judge import judge, outcome
from simscen.judge.measure.added import with_added
from simscen.judge.measure.metrics import Measures, measure
from simscen.judge.needs import known
from simscen.judge.why.cause import explained


def result_of(
    key: RunKey,
    path: str,
    criteria: Sequence[AnyCriterion],
    trace: Trace,
    case: Case,
    lines: tuple[int, ...] = (),
    coverage: Coverage = WHOLE,
    metrics: Sequence[AnyMeasure] = (),
    expected: Expectation | None = None,
) -> RunResult:
    """Judge a trace and sum it up; `metrics` are measured besides those of every run, and it may be
    `expected` to fail.

    `path` is the scenario's file, `lines` where each criterion stands in it, () for a file that does not hold them.
    What had to happen and did not is a verdict, too; it comes first, for it is the reason of what follows.
    """
    verdicts = explained(judge(criteria, trace, case, coverage), trace, case)
    happened = happenings(trace, case)
    lacking = missing(trace, happened, verdicts)
    lines = (*(line for _, line in lacking), *lines) if lines else ()
    verdicts = (*(verdict for verdict, _ in lacking), *verdicts)
    came_out, on_that = as_expected(expected, verdicts, outcome(verdicts), finished(trace))
    if expected is not None and on_that is not None:
        verdicts, lines = (*verdicts, on_that), (*lines, expected.line) if lines else ()
    failure = _why(verdicts) if came_out is Outcome.ERROR else None
    measures = Measures({}, {})
    try:
        measures = with_added(known(measure(trace, case), coverage), metrics, trace, case, coverage)
    except BrokenTrace as broken:  # whatever the criteria looked at, a run with such a signal is no run
        came_out, failure = Outcome.ERROR, failure or RunFailure("invalid", str(broken))
    return RunResult(
        key=key,
        path=path,
        outcome=came_out,
        verdicts=verdicts,
        lines=lines,
        metrics=measures.values,
        undefined=measures.undefined,
        events=dict(sorted(Counter(str(event.kind) for event in trace.events).items())),
        disturbances=happened,
        ended=ending(trace),
        simulated=trace.seconds(trace.end),
        tick_rate=trace.tick_rate,
        error=failure,
        reason="" if expected is None else expected.reason,
    )


def _why(verdicts: tuple[Verdict, ...]) -> RunFailure:
    broken = [f"{v.id}: {v.tightest.measured}" for v in verdicts if v.status is Status.ERROR and v.tightest]
    return RunFailure("invalid", "; ".join(broken) or "nothing judged this run")
