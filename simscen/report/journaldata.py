"""Runs as lines of the journal, and back."""

from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from simscen.core.records.run_result import RunKey
from simscen.core.records.session_events import Artifacts, RunFinished
from simscen.judge.result_json import from_data, read_key, result_data
from simscen.report.results import relative

NAME = "events.jsonl"
FORMAT = 2


@dataclass(frozen=True)
class Planned:
    """A run that a session has taken on; `path` is the scenario's file.

    `digest` changes with everything the run depends on, so that an old answer is not kept for a new question. `again`
    and `file` are as in RunFinished; they depend on where the session was started, which is no other question. `stack`
    is as in RunResult; what it stands for is in the digest.
    """

    key: RunKey
    path: str
    digest: str = ""
    again: str = field(default="", compare=False)
    file: str = field(default="", compare=False)
    stack: str = field(default="", compare=False)


def planned_data(run: Planned) -> dict[str, Any]:
    """A planned run as plain data."""
    where = {"path": run.path, "file": run.file, "again": run.again, "stack": run.stack}
    return {**asdict(run.key), **where, "digest": run.digest}


def read_planned(data: dict[str, Any]) -> Planned:
    """The run that `planned_data` described. Raises KeyError or TypeError when it is none."""
    return Planned(read_key(data), data["path"], data["digest"], data["again"], data["file"], data.get("stack", ""))


def run_data(run: RunFinished, folder: Path) -> dict[str, Any]:
    """An answer as plain data: its result.json and what that leaves out. Files are relative to `folder`."""
    files = {name: relative(path, str(folder)) if path else "" for name, path in asdict(run.artifacts).items()}
    about = {"wall": run.wall, "again": run.again, "file": run.file, "tags": list(run.tags)}
    about |= {"resumed": True} if run.resumed else {}
    return {**about, "files": files, "result": result_data(run.result)}


def read_run(data: dict[str, Any], folder: Path) -> RunFinished:
    """The answer that `run_data` described, its files now in `folder`. Raises KeyError, TypeError or ValueError."""
    files = {name: str(folder / path) if path else "" for name, path in data["files"].items()}
    result, tags = from_data(data["result"]), tuple(data.get("tags", ()))
    return RunFinished(
        result, data["wall"], Artifacts(**files), data["again"], data["file"], tags, resumed=data.get("resumed", False)
    )
