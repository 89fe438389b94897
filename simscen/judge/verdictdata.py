"""Verdicts as plain data that JSON can hold, and back."""

import math
from typing import Any

from simscen.core.verdict import Finding, Status, Verdict
from simscen.judge.wording import sentence


def verdict_data(verdict: Verdict, line: int, tick_rate: int) -> dict[str, Any]:
    """A verdict with all its findings. `line` is where the criterion is written; 0 = unknown."""
    return {
        "criterion": verdict.criterion,
        "id": verdict.id,
        "severity": verdict.severity,
        "status": verdict.status.value,
        "line": line,
        "findings": [_finding_data(verdict, finding, tick_rate) for finding in verdict.findings],
    }


def read_verdict(data: dict[str, Any]) -> Verdict:
    """The verdict that `verdict_data` described. Raises KeyError or ValueError when it is none."""
    findings = tuple(_read_finding(finding) for finding in data["findings"])
    return Verdict(data["criterion"], data["id"], data["severity"], findings)


def number(value: float | None) -> float | None:
    """JSON knows neither nan nor infinity."""
    return value if value is not None and math.isfinite(value) else None


def _finding_data(verdict: Verdict, finding: Finding, tick_rate: int) -> dict[str, Any]:
    return {
        "status": finding.status.value,
        "what": finding.what,
        "measured": finding.measured,
        "limit": finding.limit,
        "margin": number(finding.margin),
        "value": number(finding.value),
        "unit": finding.unit,
        "tick": finding.tick,
        "time": None if finding.tick is None else finding.tick / tick_rate,
        "place": None if finding.place is None else list(finding.place),
        "detail": list(finding.detail),
        "message": sentence(verdict, finding, tick_rate),
    }


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
