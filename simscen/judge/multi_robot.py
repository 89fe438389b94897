"""The result of a run of several robots, from what came of each."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from typing import TypeVar

from simscen.core.records.disturbances import DisturbanceOutcome
from simscen.core.records.events import Event
from simscen.core.records.run_result import Outcome, RunFailure, RunResult
from simscen.core.records.trace import Trace
from simscen.core.records.verdict import ExpectedFailure, Verdict
from simscen.criteria.timeline import has_ended
from simscen.judge.expected_failure import apply_expectation
from simscen.judge.finding_text import DISTURBANCE

T = TypeVar("T")
SUCCESS = "success"
OF_ALL = ("object.", "pedestrian.", "event.", "mark", "run.")
"""Kinds of events that happen to the world, and are in the log of each robot."""


def combine_robots(
    results: Mapping[str, RunResult], traces: Mapping[str, Trace], expected: ExpectedFailure | None = None
) -> RunResult:
    """One result: all passes where each does; verdicts, metrics and faults are called `robot/name`.

    What happens to the world has no robot and is told once. The metric `success` is there for the run as well. The run
    may be `expected` to fail.
    """
    first = next(iter(results.values()))
    shared = {one.ordered.name for one in first.disturbances if one.ordered.kind == "event"}
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
    """The verdict as one of this robot; that on a fault that did not happen tells the fault's name in its finding."""
    findings = verdict.findings
    if verdict.criterion == DISTURBANCE:
        findings = tuple(replace(finding, measured=f"{robot}/{finding.measured}") for finding in findings)
    return replace(verdict, id=f"{robot}/{verdict.id}", findings=findings)


def _of_the_world(verdict: Verdict, events: set[str]) -> bool:
    """Whether it says that an event of the scenario did not happen."""
    return verdict.criterion == DISTURBANCE and not events.isdisjoint((verdict.id, verdict.id.rpartition("#")[0]))


def _worst(results: Mapping[str, RunResult]) -> Outcome:
    outcomes = [result.outcome for result in results.values()]
    return next((worst for worst in (Outcome.ERROR, Outcome.FAILED) if worst in outcomes), Outcome.PASSED)


def _named(parts: Mapping[str, Mapping[str, T]]) -> dict[str, T]:
    return {f"{name}/{key}": value for name, part in parts.items() for key, value in part.items()}


def _events(traces: Mapping[str, Trace]) -> dict[str, int]:
    """How often what happened, each thing once; that the robots are there is nothing that happens."""
    first = next(iter(traces.values()))
    counts = Counter(str(event.kind) for event in first.events if _shared(event) and event.name not in traces)
    for trace in traces.values():
        counts.update(str(event.kind) for event in trace.events if not _shared(event))
    return dict(sorted(counts.items()))


def _shared(event: Event) -> bool:
    return str(event.kind).startswith(OF_ALL)


def _happenings(result: RunResult, kind: str) -> list[DisturbanceOutcome]:
    return [one for one in result.disturbances if one.ordered.kind == kind]


def _faults(results: Mapping[str, RunResult]) -> list[DisturbanceOutcome]:
    return [
        replace(one, ordered=replace(one.ordered, name=f"{name}/{one.ordered.name}"))
        for name, result in results.items()
        for one in _happenings(result, "fault")
    ]


def _failure(name: str, error: RunFailure | None) -> RunFailure | None:
    return error and replace(error, message=f"{name}: {error.message}")
