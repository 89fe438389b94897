"""Runs as lines of the journal, and back."""

from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any

from simscen.core.sessionevents import Artifacts, RunFinished, RunKey
from simscen.judge.result import as_data, from_data
from simscen.report.results import relative, result_of

NAME = "events.jsonl"
FORMAT = 1


@dataclass(frozen=True)
class Planned:
    """A run that a session has taken on: `path` and `line` are where it is written.

    `digest` changes with everything the run depends on, so that an old answer is not kept for a new question. `again`
    and `file` are as in RunFinished; they depend on where the session was started, which is no other question.
    """

    key: RunKey
    path: str
    line: int = 1
    digest: str = ""
    again: str = field(default="", compare=False)
    file: str = field(default="", compare=False)


def planned_data(run: Planned) -> dict[str, Any]:
    """A planned run as plain data."""
    where = {"path": run.path, "line": run.line, "file": run.file, "again": run.again}
    return {**asdict(run.key), **where, "digest": run.digest}


def read_planned(data: dict[str, Any]) -> Planned:
    """The run that `planned_data` described. Raises KeyError or TypeError when it is none."""
    key = RunKey(data["scenario"], data["seed"], data["variation"])
    return Planned(key, data["path"], data["line"], data["digest"], data["again"], data["file"])


def run_data(run: RunFinished, folder: Path) -> dict[str, Any]:
    """An answer as plain data: its result.json and what that leaves out. Files are relative to `folder`."""
    files = {name: relative(path, str(folder)) if path else "" for name, path in asdict(run.artifacts).items()}
    more = {"line": run.line, "wall": run.wall, "again": run.again, "file": run.file}
    return {**more, "files": files, "result": as_data(result_of(run))}


def read_run(data: dict[str, Any], key: RunKey, folder: Path) -> RunFinished:
    """The answer that `run_data` described, its files now in `folder`. Raises KeyError, TypeError or ValueError."""
    result = from_data(data["result"])
    files = {name: str(folder / path) if path else "" for name, path in data["files"].items()}
    run = RunFinished(
        key=key,
        path=result.path,
        line=data["line"],
        outcome=result.outcome,
        verdicts=result.verdicts,
        lines=result.lines,
        simulated=result.simulated,
        wall=data["wall"],
        ended=result.ended,
        metrics=tuple(sorted(result.metrics.items())),
        artifacts=Artifacts(**files),
        error=result.error,
        again=data["again"],
        file=data["file"],
        tick_rate=result.tick_rate,
    )
    return replace(run, lines=()) if not any(run.lines) else run
