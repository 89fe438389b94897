"""The result of one run, and result.json: no wall clock, host or process in it, so that it can be compared."""

import json
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from simscen.core.case import Case
from simscen.core.sessionevents import Outcome, RunFailure, RunKey
from simscen.core.trace import Trace
from simscen.core.verdict import Status, Verdict
from simscen.criteria.bounds import BrokenTrace
from simscen.criteria.moments import ending
from simscen.judge.judge import outcome
from simscen.judge.metrics import measure
from simscen.judge.verdictdata import number, read_verdict, verdict_data

FORMAT = 1


@dataclass(frozen=True)
class RunResult:
    """All that a run says about itself.

    `path` and `lines` are where the scenario and each of its criteria are written. `events` counts what happened, by
    kind. `simulated` is in seconds. `error` is set exactly when the outcome is ERROR.
    """

    key: RunKey
    path: str
    outcome: Outcome
    verdicts: tuple[Verdict, ...] = ()
    lines: tuple[int, ...] = ()
    metrics: Mapping[str, float | None] = field(default_factory=dict)
    events: Mapping[str, int] = field(default_factory=dict)
    ended: str = ""
    simulated: float = 0.0
    tick_rate: int = 240
    error: RunFailure | None = None

    @property
    def again(self) -> str:
        """The command that repeats the run."""
        return f"simscen run {self.path} --seed {self.key.seed}"


def run_result(
    scenario: str,
    path: str,
    seed: int,
    verdicts: tuple[Verdict, ...],
    trace: Trace,
    case: Case,
    *,
    variation: str = "",
    lines: tuple[int, ...] = (),
) -> RunResult:
    """Sum up a run that came to its end: `scenario` is the id, `path` the file as the user would write it."""
    came_out = outcome(verdicts)
    failure = _why(verdicts) if came_out is Outcome.ERROR else None
    metrics: Mapping[str, float | None] = {}
    try:
        metrics = measure(trace, case)
    except BrokenTrace as broken:  # whatever the criteria looked at, a run with such a signal is no run
        came_out, failure = Outcome.ERROR, failure or RunFailure("invalid", str(broken))
    return RunResult(
        key=RunKey(scenario, seed, variation),
        path=path,
        outcome=came_out,
        verdicts=verdicts,
        lines=lines,
        metrics=metrics,
        events=dict(sorted(Counter(event.kind for event in trace.events).items())),
        ended=ending(trace),
        simulated=trace.seconds(trace.end),
        tick_rate=trace.tick_rate,
        error=failure,
    )


def to_json(result: RunResult) -> str:
    """Sorted, indented, with a newline at the end: the same result gives the same bytes."""
    return json.dumps(as_data(result), sort_keys=True, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def as_data(result: RunResult) -> dict[str, Any]:
    """The same as plain data, for results.json and others that hold several."""
    lines = result.lines or (0,) * len(result.verdicts)
    error = result.error
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
        "metrics": {name: number(value) for name, value in result.metrics.items()},
        "verdicts": [verdict_data(v, line, result.tick_rate) for v, line in zip(result.verdicts, lines, strict=True)],
        "error": None if error is None else {"kind": error.kind, "message": error.message, "tail": error.tail},
    }


def from_json(text: str) -> RunResult:
    """The result that `to_json` wrote. Raises ValueError when it is none, or one of another format."""
    try:
        return from_data(json.loads(text))
    except (KeyError, TypeError) as error:
        raise ValueError(f"not a result of a run: {error!r}") from error


def read_result(path: Path) -> RunResult:
    """Read a result.json. Raises OSError or ValueError."""
    return from_json(path.read_text(encoding="utf-8"))


def from_data(data: dict[str, Any]) -> RunResult:
    """The result that `as_data` described."""
    if data["format"] != FORMAT:
        raise ValueError(f"a result of format {data['format']}; this version reads {FORMAT}")
    return RunResult(
        key=RunKey(data["scenario"], data["seed"], data["variation"]),
        path=data["path"],
        outcome=Outcome(data["outcome"]),
        verdicts=tuple(read_verdict(verdict) for verdict in data["verdicts"]),
        lines=tuple(verdict["line"] for verdict in data["verdicts"]),
        metrics=data["metrics"],
        events=data["events"],
        ended=data["ended"],
        simulated=data["simulated_seconds"],
        tick_rate=data["tick_rate"],
        error=None if data["error"] is None else RunFailure(**data["error"]),
    )


def _why(verdicts: tuple[Verdict, ...]) -> RunFailure:
    broken = [f"{v.id}: {v.tightest.measured}" for v in verdicts if v.status is Status.ERROR and v.tightest]
    return RunFailure("invalid", "; ".join(broken) or "nothing judged this run")
