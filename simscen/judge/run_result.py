"""Judges a run: verdicts, metrics, disturbances and the outcome."""

from collections import Counter
from collections.abc import Sequence

from simscen.core.records.case import Case
from simscen.core.records.evidence import COMPLETE_COVERAGE, LogCoverage
from simscen.core.records.run_result import Outcome, RunFailure, RunKey, RunResult
from simscen.core.records.trace import Trace
from simscen.core.records.verdict import ExpectedFailure, Status, Verdict
from simscen.criteria.findings import InvalidTrace
from simscen.criteria.plugin_metric import AnyMeasure
from simscen.criteria.registry import AnyCriterion
from simscen.criteria.timeline import end_reason, has_ended
from simscen.criteria.trace_signals.coverage import check_recorded_signals, time_gaps
from simscen.judge.diagnosis.causes import explain_failures
from simscen.judge.disturbances import disturbance_outcomes, missing_disturbances
from simscen.judge.evaluation import judge, outcome_of_verdicts
from simscen.judge.expected_failure import apply_expectation
from simscen.judge.metrics.compute import compute_metrics
from simscen.judge.metrics.plugin_metrics import add_plugin_metrics


def judge_run(
    key: RunKey,
    path: str,
    criteria: Sequence[AnyCriterion],
    trace: Trace,
    case: Case,
    lines: tuple[int, ...] = (),
    coverage: LogCoverage = COMPLETE_COVERAGE,
    metrics: Sequence[AnyMeasure] = (),
    expected: ExpectedFailure | None = None,
) -> RunResult:
    """Return the result of a run.

    `path` is the scenario's file, `lines` the line of each criterion in it; () for a file that does not hold them.
    `metrics` are those of plug-ins, computed in addition to those of every run. `expected` says that the run is
    expected to fail. A disturbance that did not happen has a verdict of its own, before the others, because it often
    explains them. The log of any recorder passes only where its signals cover the run (`time_gaps`).
    """
    coverage = coverage.with_gaps(time_gaps(trace))
    verdicts = explain_failures(judge(criteria, trace, case, coverage), trace, case)
    happened = disturbance_outcomes(trace, case)
    lacking = missing_disturbances(trace, happened, verdicts)
    lines = (*(line for _, line in lacking), *lines) if lines else ()
    verdicts = (*(verdict for verdict, _ in lacking), *verdicts)
    came_out, on_that = apply_expectation(expected, verdicts, outcome_of_verdicts(verdicts), has_ended(trace))
    if expected is not None and on_that is not None:
        verdicts, lines = (*verdicts, on_that), (*lines, expected.line) if lines else ()
    failure = _reason(verdicts) if came_out is Outcome.ERROR else None
    computed = compute_metrics(trace, case, coverage)
    try:
        if coverage.recorded_by_simscen:
            check_recorded_signals(trace)
        computed = add_plugin_metrics(computed, metrics, trace, case, coverage)
    except InvalidTrace as invalid:
        came_out, failure = Outcome.ERROR, failure or RunFailure("invalid", str(invalid))
    return RunResult(
        key=key,
        path=path,
        outcome=came_out,
        verdicts=verdicts,
        lines=lines,
        metrics=computed.values,
        undefined=computed.undefined,
        events=dict(sorted(Counter(str(event.kind) for event in trace.events).items())),
        disturbances=happened,
        ended=end_reason(trace),
        simulated=trace.seconds(trace.end),
        tick_rate=trace.tick_rate,
        error=failure,
        reason="" if expected is None else expected.reason,
    )


def _reason(verdicts: tuple[Verdict, ...]) -> RunFailure:
    broken = [f"{v.id}: {v.tightest.measured}" for v in verdicts if v.status is Status.ERROR and v.tightest]
    return RunFailure("invalid", "; ".join(broken) or "nothing judged this run")
