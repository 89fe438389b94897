"""Judgment of the run of one robot: computes verdicts, outcomes of disturbances, metrics, and the outcome."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

from simscen.core.records.case import Case
from simscen.core.records.run_result import Outcome, RunFailure, RunKey, RunResult
from simscen.core.records.trace import Trace
from simscen.core.records.verdict import COMPLETE_COVERAGE, ExpectedFailure, LogCoverage, Status, Verdict
from simscen.criteria.base import AnyMeasure
from simscen.criteria.findings import InvalidTrace
from simscen.criteria.registry import AnyCriterion
from simscen.criteria.timeline import end_reason, has_ended
from simscen.criteria.trace_signals.trace_checks import check_recorded_signals, time_gaps
from simscen.judge.disturbances import disturbance_outcomes, missing_disturbances
from simscen.judge.evaluation import judge
from simscen.judge.failure_causes import explain_failures
from simscen.judge.metrics.compute import add_plugin_metrics, compute_metrics
from simscen.judge.outcome import apply_expectation, outcome_of_verdicts


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

    Verdicts on required disturbances that did not happen come first. A criterion is inconclusive instead of passed if
    the signals that it needs have gaps.

    path:      scenario file
    criteria:  criteria to evaluate, in the order of the verdicts
    trace:     recorded states and events of the run
    case:      what the criteria know about the scenario, such as goals and disturbances
    lines:     line of each criterion in the scenario file; () if the criteria come from another file
    coverage:  evidence that the log contains, and for which part of the run
    metrics:   additional metrics of plug-ins
    expected:  expected failure of the run; None to expect success
    """
    coverage = replace(coverage, partial={**time_gaps(trace), **coverage.partial})
    verdicts = explain_failures(judge(criteria, trace, case, coverage), trace, case)
    disturbances = disturbance_outcomes(trace, case)
    missing = missing_disturbances(trace, disturbances, verdicts)
    lines = (*(line for _, line in missing), *lines) if lines else ()
    verdicts = (*(verdict for verdict, _ in missing), *verdicts)
    happened = {one.disturbance.name for one in disturbances if one.happened}
    outcome, expectation = apply_expectation(
        expected, verdicts, outcome_of_verdicts(verdicts), has_ended(trace), happened
    )
    if expected is not None and expectation is not None:
        verdicts, lines = (*verdicts, expectation), (*lines, expected.line) if lines else ()
    failure = _judging_failure(verdicts) if outcome is Outcome.ERROR else None
    computed = compute_metrics(trace, case, coverage)
    try:
        if coverage.recorded_by_simscen:
            check_recorded_signals(trace)
        computed = add_plugin_metrics(computed, metrics, trace, case, coverage)
    except InvalidTrace as invalid:
        outcome, failure = Outcome.ERROR, failure or RunFailure("invalid", str(invalid))
    return RunResult(
        key=key,
        path=path,
        outcome=outcome,
        verdicts=verdicts,
        lines=lines,
        metrics=computed.values,
        undefined=computed.undefined,
        events=dict(sorted(Counter(str(event.kind) for event in trace.events).items())),
        disturbances=disturbances,
        ended=end_reason(trace),
        simulated=trace.seconds(trace.end),
        tick_rate=trace.tick_rate,
        error=failure,
        reason="" if expected is None else expected.reason,
    )


def _judging_failure(verdicts: tuple[Verdict, ...]) -> RunFailure:
    """Return the failure of a run without criteria, or with criteria that raised exceptions."""
    broken = [f"{v.id}: {v.tightest.measured}" for v in verdicts if v.status is Status.ERROR and v.tightest]
    return RunFailure("invalid", "; ".join(broken) or "no criterion judged this run")
