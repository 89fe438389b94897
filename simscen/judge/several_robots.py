"""Combination of the results of the robots of one run into a single result."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from typing import TypeVar

from simscen.core.records.disturbances import DisturbanceOutcome
from simscen.core.records.events import Event
from simscen.core.records.run_result import Outcome, RunResult
from simscen.core.records.trace import Trace
from simscen.core.records.verdict import ExpectedFailure, Verdict
from simscen.criteria.timeline import has_ended
from simscen.judge.finding_text import DISTURBANCE
from simscen.judge.metrics.compute import NO_GOALS
from simscen.judge.outcome import apply_expectation

T = TypeVar("T")
SUCCESS = "success"
"""Name of the success metric (1 or 0) of a run and of each robot."""
WORLD_EVENT_PREFIXES = ("object.", "pedestrian.", "floor.", "event.", "mark", "run.")
"""Prefixes of the kinds of events of the world, which the trace of each robot contains."""


def combine_robots(
    results: Mapping[str, RunResult], traces: Mapping[str, Trace], expected: ExpectedFailure | None = None
) -> RunResult:
    """Return the result of a run from the results and traces of its robots, by name of the robot.

    The run passes if all robots pass. Verdicts, metrics, and faults of a robot get the name `robot/name`. Events of the
    world and verdicts on events are listed once. The metric `success` of the run is 1 if it is 1 for all robots with
    goals. The error is the one of the first robot with an error. `expected` is the expected failure of the run; None to
    expect success.
    """
    first = next(iter(results.values()))
    event_names = {one.disturbance.name for one in first.disturbances if one.disturbance.kind == "event"}
    judged = [pair for pair in first.verdicts_with_lines if _is_about_event(pair[0], event_names)]
    for name, result in results.items():
        judged += [
            (_with_robot_name(verdict, name), line)
            for verdict, line in result.verdicts_with_lines
            if not _is_about_event(verdict, event_names)
        ]
    verdicts = tuple(verdict for verdict, _ in judged)
    outcomes = [result.outcome for result in results.values()]
    worst = next((each for each in (Outcome.ERROR, Outcome.FAILED) if each in outcomes), Outcome.PASSED)
    disturbances = (
        *(one for one in first.disturbances if one.disturbance.kind == "event"),
        *_faults_with_robot_names(results),
    )
    happened = {one.disturbance.name for one in disturbances if one.happened}
    is_complete = all(map(has_ended, traces.values()))
    outcome, expectation = apply_expectation(expected, verdicts, worst, is_complete, happened)
    if expected is not None and expectation is not None:
        judged.append((expectation, expected.line))
    errors = [
        replace(result.error, message=f"{name}: {result.error.message}")
        for name, result in results.items()
        if result.error is not None
    ]
    with_goals = [result for result in results.values() if result.undefined.get(SUCCESS) != NO_GOALS]
    successes = [result.metrics.get(SUCCESS) for result in with_goals]
    success = min((value for value in successes if value is not None), default=None) if None not in successes else None
    return replace(
        first,
        outcome=outcome,
        verdicts=tuple(verdict for verdict, _ in judged),
        lines=tuple(line for _, line in judged) if first.lines else (),
        metrics={SUCCESS: success, **_with_robot_names({name: result.metrics for name, result in results.items()})},
        undefined=_with_robot_names({name: result.undefined for name, result in results.items()}),
        events=_event_counts(traces),
        disturbances=disturbances,
        error=errors[0] if errors else None,
        reason="" if expected is None else expected.reason,
    )


def _with_robot_name(verdict: Verdict, robot: str) -> Verdict:
    """Return the verdict with the name of the robot in the ID and in the text of a missing fault."""
    findings = verdict.findings
    if verdict.criterion == DISTURBANCE:
        findings = tuple(replace(finding, measured=f"{robot}/{finding.measured}") for finding in findings)
    return replace(verdict, id=f"{robot}/{verdict.id}", findings=findings)


def _is_about_event(verdict: Verdict, event_names: set[str]) -> bool:
    """Return whether the verdict is about one of these events, which did not happen."""
    return verdict.criterion == DISTURBANCE and not event_names.isdisjoint((verdict.id, verdict.id.rpartition("#")[0]))


def _with_robot_names(values: Mapping[str, Mapping[str, T]]) -> dict[str, T]:
    """Return values, given by robot and name, by `robot/name`."""
    return {f"{robot}/{name}": value for robot, by_name in values.items() for name, value in by_name.items()}


def _event_counts(traces: Mapping[str, Trace]) -> dict[str, int]:
    """Return the number of events by kind. Events of the world count once.

    The spawning of robots, which are objects in the traces of the other robots, does not count.
    """
    first = next(iter(traces.values()))
    counts = Counter(str(event.kind) for event in first.events if _is_world_event(event) and event.name not in traces)
    for trace in traces.values():
        counts.update(str(event.kind) for event in trace.events if not _is_world_event(event))
    return dict(sorted(counts.items()))


def _is_world_event(event: Event) -> bool:
    return str(event.kind).startswith(WORLD_EVENT_PREFIXES)


def _faults_with_robot_names(results: Mapping[str, RunResult]) -> list[DisturbanceOutcome]:
    return [
        replace(one, disturbance=replace(one.disturbance, name=f"{name}/{one.disturbance.name}"))
        for name, result in results.items()
        for one in result.disturbances
        if one.disturbance.kind == "fault"
    ]
