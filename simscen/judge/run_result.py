"""Judges a run: verdicts, metrics, disturbances and the outcome."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TypeVar

from simscen.core.records.case import Case
from simscen.core.records.events import DisturbanceOutcome, Event
from simscen.core.records.run_result import Outcome, RunFailure, RunKey, RunResult
from simscen.core.records.trace import Trace
from simscen.core.records.verdict import COMPLETE_COVERAGE, ExpectedFailure, LogCoverage, Status, Verdict
from simscen.criteria.base import AnyMeasure
from simscen.criteria.findings import InvalidTrace
from simscen.criteria.registry import AnyCriterion
from simscen.criteria.timeline import end_reason, has_ended
from simscen.criteria.trace_signals.sampling import check_recorded_signals, time_gaps
from simscen.judge.diagnosis.causes import explain_failures
from simscen.judge.disturbances import disturbance_outcomes, missing_disturbances
from simscen.judge.evaluation import apply_expectation, judge, outcome_of_verdicts
from simscen.judge.finding_text import DISTURBANCE
from simscen.judge.metrics.compute import add_plugin_metrics, compute_metrics


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


T = TypeVar("T")
SUCCESS = "success"
OF_ALL = ("object.", "pedestrian.", "event.", "mark", "run.")
"""Kinds of events of the world, which the log of each robot contains."""


def combine_robots(
    results: Mapping[str, RunResult], traces: Mapping[str, Trace], expected: ExpectedFailure | None = None
) -> RunResult:
    """Return the combined result of several robots, which passes if all robots pass.

    Verdicts, metrics and faults get the name `robot/name`. Events of the world have no robot and are listed once. The
    metric `success` also exists for the run. `expected` says that the run is expected to fail.
    """
    first = next(iter(results.values()))
    shared = {one.disturbance.name for one in first.disturbances if one.disturbance.kind == "event"}
    told = [(verdict, line) for verdict, line in _lined(first) if _of_the_world(verdict, shared)]
    for name, result in results.items():
        own = ((verdict, line) for verdict, line in _lined(result) if not _of_the_world(verdict, shared))
        told += [(_called(verdict, name), line) for verdict, line in own]
    verdicts = tuple(verdict for verdict, _ in told)
    came_out, on_that = apply_expectation(expected, verdicts, _worst(results), all(map(has_ended, traces.values())))
    if expected is not None and on_that is not None:
        told.append((on_that, expected.line))
    errors = [(name, result.error) for name, result in results.items() if result.error is not None]
    successes = [result.metrics.get(SUCCESS) for result in results.values()]
    success = None if None in successes else min(value for value in successes if value is not None)
    return replace(
        first,
        outcome=came_out,
        verdicts=tuple(verdict for verdict, _ in told),
        lines=tuple(line for _, line in told) if first.lines else (),
        metrics={SUCCESS: success, **_named({name: result.metrics for name, result in results.items()})},
        undefined=_named({name: result.undefined for name, result in results.items()}),
        events=_events(traces),
        disturbances=(*_happenings(first, "event"), *_faults(results)),
        error=_failure(errors[0][0], errors[0][1]) if errors else None,
        reason="" if expected is None else expected.reason,
    )


def _lined(result: RunResult) -> list[tuple[Verdict, int]]:
    return list(zip(result.verdicts, result.lines or (0,) * len(result.verdicts), strict=True))


def _called(verdict: Verdict, robot: str) -> Verdict:
    """Return the verdict with the name of the robot. For a missing fault, the finding contains the fault's name."""
    findings = verdict.findings
    if verdict.criterion == DISTURBANCE:
        findings = tuple(replace(finding, measured=f"{robot}/{finding.measured}") for finding in findings)
    return replace(verdict, id=f"{robot}/{verdict.id}", findings=findings)


def _of_the_world(verdict: Verdict, events: set[str]) -> bool:
    """Return whether the verdict is about a missing event of the scenario."""
    return verdict.criterion == DISTURBANCE and not events.isdisjoint((verdict.id, verdict.id.rpartition("#")[0]))


def _worst(results: Mapping[str, RunResult]) -> Outcome:
    outcomes = [result.outcome for result in results.values()]
    return next((worst for worst in (Outcome.ERROR, Outcome.FAILED) if worst in outcomes), Outcome.PASSED)


def _named(parts: Mapping[str, Mapping[str, T]]) -> dict[str, T]:
    return {f"{name}/{key}": value for name, part in parts.items() for key, value in part.items()}


def _events(traces: Mapping[str, Trace]) -> dict[str, int]:
    """Return the number of events by kind. Events of the world count once, and spawned robots do not count."""
    first = next(iter(traces.values()))
    counts = Counter(str(event.kind) for event in first.events if _shared(event) and event.name not in traces)
    for trace in traces.values():
        counts.update(str(event.kind) for event in trace.events if not _shared(event))
    return dict(sorted(counts.items()))


def _shared(event: Event) -> bool:
    return str(event.kind).startswith(OF_ALL)


def _happenings(result: RunResult, kind: str) -> list[DisturbanceOutcome]:
    return [one for one in result.disturbances if one.disturbance.kind == kind]


def _faults(results: Mapping[str, RunResult]) -> list[DisturbanceOutcome]:
    return [
        replace(one, disturbance=replace(one.disturbance, name=f"{name}/{one.disturbance.name}"))
        for name, result in results.items()
        for one in _happenings(result, "fault")
    ]


def _failure(name: str, error: RunFailure | None) -> RunFailure | None:
    return error and replace(error, message=f"{name}: {error.message}")
