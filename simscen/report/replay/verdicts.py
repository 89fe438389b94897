"""How the criteria came out, as the page shows it: what failed first, when, where, and the line that asks for it."""

from typing import Any

from simscen.core.records.run_result import RunResult
from simscen.core.records.verdict import Finding, Verdict
from simscen.judge.finding_text import DISTURBANCE, comparison, disturbance_times, subject
from simscen.report.replay.lines import Lines
from simscen.report.text import one_line


def verdicts_of(result: RunResult, lines: dict[str, Lines]) -> list[dict[str, Any]]:
    """All verdicts in their order; of several robots each with its robot."""
    return [_verdict(verdict, result, lines) for verdict in result.verdicts]


def disturbances_of(result: RunResult, lines: dict[str, Lines]) -> list[dict[str, Any]]:
    """Each event and fault of the scenario: when it began, and what it changed."""
    told, numbers = [], {"event": 0, "fault": 0}
    first = next(iter(lines.values()))
    for one in result.disturbances:
        number = numbers[one.ordered.kind]
        numbers[one.ordered.kind] += 1
        known = first.events if one.ordered.kind == "event" else first.faults
        told.append(
            {
                "kind": one.ordered.kind,
                "name": one_line(one.ordered.name),
                "ordered": one_line(one.ordered.trigger),
                "when": one_line(disturbance_times(one, result.tick_rate)),
                "fired": list(one.fired),
                "happened": one.happened,
                "missing": one.missing,
                "effect": one_line(one.effect),
                "line": known.get(number, one.ordered.line) if len(lines) == 1 else one.ordered.line,
            }
        )
    return told


def _verdict(verdict: Verdict, result: RunResult, lines: dict[str, Lines]) -> dict[str, Any]:
    robot, _, name = verdict.id.partition("/")
    if robot not in lines or not name:
        robot, name = next(iter(lines)), verdict.id
    return {
        "id": one_line(verdict.id),
        "robot": robot,
        "status": verdict.status.value,
        "severity": verdict.severity,
        "line": lines[robot].criteria.get(name) or _disturbed(verdict, name, result),
        "findings": [_finding(verdict, finding) for finding in verdict.findings],
        "tightest": verdict.findings.index(verdict.tightest) if verdict.tightest is not None else None,
    }


def _disturbed(verdict: Verdict, name: str, result: RunResult) -> int:
    """The line of the event or fault that did not happen."""
    if verdict.criterion != DISTURBANCE:
        return 0
    ordered = [one.ordered for one in result.disturbances]
    return next((one.line for one in ordered if one.name in (name, name.rpartition("#")[0])), 0)


def _finding(verdict: Verdict, finding: Finding) -> dict[str, Any]:
    return {
        "status": finding.status.value,
        "what": one_line(subject(verdict, finding)),
        "said": one_line(comparison(finding)),
        "margin": None if finding.margin is None else f"{finding.margin:+.3g} {finding.unit}".rstrip(),
        "tick": finding.tick,
        "place": None if finding.place is None else [round(axis, 3) for axis in finding.place],
        "detail": [one_line(text) for text in finding.detail],
    }
