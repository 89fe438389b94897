"""Conversion of the result of a run to result.json and back."""

import json
import math
from dataclasses import asdict, fields
from pathlib import Path
from sys import intern
from typing import Any

from simscen.core.records.disturbances import Disturbance, DisturbanceOutcome
from simscen.core.records.run_result import Outcome, RunFailure, RunKey, RunResult
from simscen.core.records.verdict import Finding, Status, Verdict
from simscen.judge.finding_text import sentence

FORMAT = 2
"""Version of the format of result.json. Files of other versions are rejected."""


def to_json(result: RunResult) -> str:
    """Return the content of result.json."""
    return json.dumps(result_data(result), sort_keys=True, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def result_data(result: RunResult) -> dict[str, Any]:
    """Return a result as JSON data."""
    error = result.error
    return {
        "format": FORMAT,
        "scenario": result.key.scenario,
        "seed": result.key.seed,
        "variation": result.key.variation,
        "stack_name": result.key.stack_name,
        "path": result.path,
        "stack": result.stack,
        "reason": result.reason,
        "outcome": result.outcome.value,
        "ended": result.ended,
        "simulated_seconds": result.simulated,
        "tick_rate": result.tick_rate,
        "again": result.again,
        "events": dict(result.events),
        "disturbances": [_disturbance_data(one, result.tick_rate) for one in result.disturbances],
        "metrics": {name: _finite_or_none(value) for name, value in result.metrics.items()},
        "undefined": dict(result.undefined),
        "verdicts": [verdict_data(verdict, line, result.tick_rate) for verdict, line in result.verdicts_with_lines],
        "error": None
        if error is None
        else {key: value for key, value in asdict(error).items() if key != "by_stack" or value},
    }


def from_json(text: str) -> RunResult:
    """Parse the text that `to_json` returned. Raises ValueError for other content or another format."""
    try:
        return from_data(json.loads(text))
    except (AttributeError, LookupError, OverflowError, RecursionError, TypeError) as error:
        raise ValueError(f"not a result of a run: {error!r}") from error


def read_result(path: Path) -> RunResult:
    """Read a result.json file. Raises OSError if it cannot be read, and ValueError for other content."""
    return from_json(path.read_text(encoding="utf-8"))


def from_data(data: dict[str, Any]) -> RunResult:
    """Return the result from the JSON data that `result_data` returned.

    Raises ValueError, AttributeError, LookupError, OverflowError, or TypeError for other content.
    """
    if data["format"] != FORMAT:
        raise ValueError(f"a result of format {data['format']}; this version reads {FORMAT}")
    for name, kind in _TYPES.items():
        if not isinstance(data.get(name, kind()), kind) or isinstance(data.get(name), bool):
            raise TypeError(f"{name} is {data[name]!r}")
    lines = tuple(verdict["line"] for verdict in data["verdicts"])
    return RunResult(
        key=read_key(data),
        path=data["path"],
        outcome=Outcome(data["outcome"]),
        verdicts=tuple(
            Verdict(one["criterion"], one["id"], one["severity"], tuple(map(_read_finding, one["findings"])))
            for one in data["verdicts"]
        ),
        lines=lines if any(lines) else (),
        metrics=data["metrics"],
        undefined=data["undefined"],
        events=data["events"],
        disturbances=tuple(_read_disturbance(one) for one in data["disturbances"]),
        ended=data["ended"],
        simulated=float(data["simulated_seconds"]),
        tick_rate=data["tick_rate"],
        error=None if data["error"] is None else RunFailure(**data["error"]),
        stack=data.get("stack", ""),  # missing in older files
        reason=data.get("reason", ""),
    )


_TYPES: dict[str, type] = {
    "path": str,
    "ended": str,
    "stack": str,
    "reason": str,
    "scenario": str,
    "seed": int,
    "variation": str,
    "tick_rate": int,
    "metrics": dict,
    "undefined": dict,
    "events": dict,
}
"""Types of values by key. These values are checked here, because the reports do not check them."""


def read_key(data: dict[str, Any]) -> RunKey:
    """Return the key of a run from the JSON data of its result."""
    # In old files without `stack_name`, `variation` is the name of the stack.
    variation, stack_name = (data["variation"], data["stack_name"]) if "stack_name" in data else ("", data["variation"])
    return RunKey(intern(data["scenario"]), data["seed"], variation, intern(stack_name))


def _disturbance_data(outcome: DisturbanceOutcome, tick_rate: int) -> dict[str, Any]:
    return {
        **asdict(outcome.disturbance),
        "fired": list(outcome.fired),
        "times": [tick / tick_rate for tick in outcome.fired],
        "happened": outcome.happened,
        "effect": outcome.effect,
        "tick": outcome.tick,
    }


def _read_disturbance(data: dict[str, Any]) -> DisturbanceOutcome:
    disturbance = Disturbance(
        data["name"], data["kind"], data["when"], data["required"], data["line"], data.get("after")
    )
    return DisturbanceOutcome(disturbance, tuple(data["fired"]), data["happened"], data["effect"], data["tick"])


def verdict_data(verdict: Verdict, line: int, tick_rate: int) -> dict[str, Any]:
    """Return a verdict and its findings as JSON data. `line` is the criterion's line in the scenario; 0 if unknown."""
    return {
        "criterion": verdict.criterion,
        "id": verdict.id,
        "severity": verdict.severity,
        "status": verdict.status.value,
        "line": line,
        "findings": [_finding_data(verdict, finding, tick_rate) for finding in verdict.findings],
    }


def _finite_or_none(value: float | None) -> float | None:
    """Return the number, or None for nan and infinity, which JSON cannot represent."""
    return value if value is not None and math.isfinite(value) else None


def _finding_data(verdict: Verdict, finding: Finding, tick_rate: int) -> dict[str, Any]:
    place = finding.place
    return {
        **vars(finding),
        "status": finding.status.value,
        "margin": _finite_or_none(finding.margin),
        "value": _finite_or_none(finding.value),
        "time": None if finding.tick is None else finding.tick / tick_rate,
        "place": list(place) if place is not None and all(map(math.isfinite, place)) else None,
        "detail": list(finding.detail),
        "message": sentence(verdict, finding, tick_rate),
    }


def _read_finding(data: dict[str, Any]) -> Finding:
    place = data["place"]
    converted = {
        "status": Status(data["status"]),
        "place": None if place is None else (place[0], place[1]),
        "detail": tuple(data["detail"]),
    }
    return Finding(**{field.name: data[field.name] for field in fields(Finding)} | converted)
