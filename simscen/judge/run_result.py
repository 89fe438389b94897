"""Judges a run that came to its end and sums it up."""

from collections import Counter
from collections.abc import Sequence

from simscen.core.case import Case
from simscen.core.evidence import WHOLE, Coverage
from simscen.core.expectation import Expectation
from simscen.core.result import Outcome, RunFailure, RunKey, RunResult
from simscen.core.trace import Trace
from simscen.core.verdict import Status, Verdict
from simscen.criteria.findings import InvalidTrace
from simscen.criteria.plugin_metric import AnyMeasure
from simscen.criteria.registry import AnyCriterion
from simscen.criteria.timeline import end_reason, has_ended
from simscen.judge.diagnosis.causes import explain_failures
from simscen.judge.disturbances import disturbance_outcomes, missing_disturbances
from simscen.judge.evaluation import judge, outcome_of_verdicts
from simscen.judge.expected_failure import apply_expectation
from simscen.judge.metrics.compute import MetricValues, add_plugin_metrics, compute_metrics
from simscen.judge.required_evidence import metrics_with_evidence


def judge_run(
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
    verdicts = explain_failures(judge(criteria, trace, case, coverage), trace, case)
    happened = disturbance_outcomes(trace, case)
    lacking = missing_disturbances(trace, happened, verdicts)
    lines = (*(line for _, line in lacking), *lines) if lines else ()
    verdicts = (*(verdict for verdict, _ in lacking), *verdicts)
    came_out, on_that = apply_expectation(expected, verdicts, outcome_of_verdicts(verdicts), has_ended(trace))
    if expected is not None and on_that is not None:
        verdicts, lines = (*verdicts, on_that), (*lines, expected.line) if lines else ()
    failure = _why(verdicts) if came_out is Outcome.ERROR else None
    measures = MetricValues({}, {})
    try:
        measures = add_plugin_metrics(
            metrics_with_evidence(compute_metrics(trace, case), coverage), metrics, trace, case, coverage
        )
    except InvalidTrace as broken:  # whatever the criteria looked at, a run with such a signal is no run
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
        ended=end_reason(trace),
        simulated=trace.seconds(trace.end),
        tick_rate=trace.tick_rate,
        error=failure,
        reason="" if expected is None else expected.reason,
    )


def _why(verdicts: tuple[Verdict, ...]) -> RunFailure:
    broken = [f"{v.id}: {v.tightest.measured}" for v in verdicts if v.status is Status.ERROR and v.tightest]
    return RunFailure("invalid", "; ".join(broken) or "nothing judged this run")
