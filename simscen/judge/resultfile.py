"""result.json: the same bytes for the same result; and back."""

import json
import math
from typing import Any

from simscen.core.session import Outcome, RunFailure, RunKey
from simscen.core.verdict import Finding, Status, Verdict
from simscen.judge.result import RunResult
from simscen.judge.wording import sentence

FORMAT = 1


def to_json(result: RunResult) -> str:
    """Sorted, indented, with a newline at the end. Numbers that JSON lacks become null."""
    return json.dumps(as_data(result), sort_keys=True, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def as_data(result: RunResult) -> dict[str, Any]:
    """The same as plain data, for results.json and others that hold several."""
    lines = result.lines or (0,) * len(result.verdicts)
    return {
        "format": FORMAT,
        "scenario": result.key.scenario,
        "seed": result.key.seed,
        "variation": result.key.variation,
        "path": result.path,
        "outcome": result.outcome.value,
        "ended": result.ended,
        "simulated_seconds": result.simulated,
        "tick_rate": result.tick_rate,
        "again": result.again,
        "events": dict(result.events),
        "metrics": {name: _number(value) for name, value in result.metrics.items()},
        "verdicts": [_verdict(v, line, result.tick_rate) for v, line in zip(result.verdicts, lines, strict=True)],
        "error": None if result.error is None else {"kind": result.error.kind, "message": result.error.message},
    }


def from_json(text: str) -> RunResult:
    """The result that `to_json` wrote. Raises ValueError when it is none, or one of another format."""
    try:
        return from_data(json.loads(text))
    except (KeyError, TypeError) as error:
        raise ValueError(f"not a result.json: {error!r}") from error


def from_data(data: dict[str, Any]) -> RunResult:
    """The result that `as_data` described."""
    if data["format"] != FORMAT:
        raise ValueError(f"result.json of format {data['format']}; this version reads {FORMAT}")
    error = data["error"]
    return RunResult(
        key=RunKey(data["scenario"], data["seed"], data["variation"]),
        path=data["path"],
        outcome=Outcome(data["outcome"]),
        verdicts=tuple(_read_verdict(verdict) for verdict in data["verdicts"]),
        lines=tuple(verdict["line"] for verdict in data["verdicts"]),
        metrics=data["metrics"],
        events=data["events"],
        ended=data["ended"],
        simulated=data["simulated_seconds"],
        tick_rate=data["tick_rate"],
        again=data["again"],
        error=None if error is None else RunFailure(error["kind"], error["message"]),
    )


def _verdict(verdict: Verdict, line: int, tick_rate: int) -> dict[str, Any]:
    return {
        "criterion": verdict.criterion,
        "id": verdict.id,
        "severity": verdict.severity,
        "status": verdict.status.value,
        "line": line,
        "findings": [_finding(verdict, finding, tick_rate) for finding in verdict.findings],
    }


def _finding(verdict: Verdict, finding: Finding, tick_rate: int) -> dict[str, Any]:
    return {
        "status": finding.status.value,
        "what": finding.what,
        "measured": finding.measured,
        "limit": finding.limit,
        "margin": _number(finding.margin),
        "value": _number(finding.value),
        "unit": finding.unit,
        "tick": finding.tick,
        "time": None if finding.tick is None else finding.tick / tick_rate,
        "place": None if finding.place is None else list(finding.place),
        "detail": list(finding.detail),
        "message": sentence(verdict, finding, tick_rate),
    }


def _read_verdict(data: dict[str, Any]) -> Verdict:
    findings = tuple(_read_finding(finding) for finding in data["findings"])
    return Verdict(data["criterion"], data["id"], data["severity"], findings)


def _read_finding(data: dict[str, Any]) -> Finding:
    place = data["place"]
    return Finding(
        status=Status(data["status"]),
        what=data["what"],
        measured=data["measured"],
        limit=data["limit"],
        margin=data["margin"],
        unit=data["unit"],
        value=data["value"],
        tick=data["tick"],
        place=None if place is None else (place[0], place[1]),
        detail=tuple(data["detail"]),
    )


def _number(value: float | None) -> float | None:
    return value if value is not None and math.isfinite(value) else None
