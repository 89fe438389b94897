"""A session as its journal tells it, also when it was killed half-way."""

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

from simscen.core.errors import InvalidInput, Problem
from simscen.core.records.run_result import RunFailure, RunKey, error_result
from simscen.core.records.session_events import RunFinished, SessionStarted, session_started
from simscen.report.checkout import from_here
from simscen.report.journaldata import FORMAT, NAME, Planned, read_planned, read_run

Run = TypeVar("Run", Planned, RunFinished)


@dataclass(frozen=True)
class Past:
    """The last session in a journal: what it planned, what was answered, and which runs had at least begun.

    `wall` is how many seconds after its start the last line was written.
    """

    version: str
    workers: int
    planned: tuple[Planned, ...]
    answered: Mapping[RunKey, RunFinished]
    begun: frozenset[RunKey]
    wall: float
    interrupted: bool

    @property
    def answers(self) -> list[RunFinished]:
        """An answer for every planned run: an error where simscen ended before there was one."""
        return [self.answered.get(run.key) or self._unanswered(run) for run in self.planned]

    def started(self, folder: Path) -> SessionStarted:
        """The event that the session began with."""
        return session_started(self.version, [run.key for run in self.planned], self.workers, folder, self.stacks)

    @property
    def stacks(self) -> tuple[str, ...]:
        """The NAME=VALUE of each stack that was chosen, in their order."""
        return tuple(dict.fromkeys(run.stack for run in self.planned if run.stack))

    def _unanswered(self, run: Planned) -> RunFinished:
        kind = "interrupted" if run.key in self.begun else "not-run"
        why = "before it was finished" if run.key in self.begun else "before it began"
        failure = RunFailure(kind, f"simscen ended {why}")
        return RunFinished(error_result(run.key, run.path, failure, run.stack), again=run.again, file=run.file)


def read_journal(folder: Path) -> Past:
    """The last session of the journal in `folder`. Raises InvalidInput when there is none that can be understood."""
    if not (folder / NAME).is_file():
        hint = "name the folder that `simscen run` wrote, e.g. simscen-out/latest"
        raise _invalid(folder, f"there is no {NAME} in it", hint)
    try:
        lines = session_lines(folder)
        if not lines:
            raise _invalid(folder / NAME, "the session ended before it had planned its runs")
        return _past(lines, folder)
    except OSError as error:
        raise _invalid(folder / NAME, f"cannot read the journal: {error.strerror}") from error
    except (ValueError, KeyError, TypeError, IndexError) as error:
        raise _invalid(folder / NAME, f"the journal is damaged: {error}") from error


def session_lines(folder: Path) -> list[dict[str, Any]]:
    """The lines of the last session; a last line that was cut short is not one. Raises OSError or ValueError."""
    whole = (folder / NAME).read_bytes().split(b"\n")[:-1]
    lines = [json.loads(line) for line in whole]
    starts = [number for number, line in enumerate(lines) if line["event"] == "planned"]
    return lines[starts[-1] :] if starts else []


def _past(lines: list[dict[str, Any]], folder: Path) -> Past:
    first = lines[0]
    if first["format"] != FORMAT:
        raise ValueError(f"it has format {first['format']}; this version reads {FORMAT}")
    cwd = first.get("cwd", "")
    planned = tuple(_seen_from_here(read_planned(run), cwd) for run in first["runs"])
    answered: dict[RunKey, RunFinished] = {}
    begun: set[RunKey] = set()
    for line in lines[1:]:
        if line["event"] == "started":
            begun.add(planned[line["run"]].key)
        elif line["event"] == "finished":
            key = planned[line["run"]].key
            answered[key] = _seen_from_here(read_run(line, folder), cwd)
    last = lines[-1]
    return Past(
        version=first["version"],
        workers=first["workers"],
        planned=planned,
        answered=answered,
        begun=frozenset(begun),
        wall=last["at"],
        interrupted=len(answered) < len(planned) or bool(last.get("interrupted")),
    )


def _seen_from_here(run: Run, cwd: str) -> Run:
    """The run with its scenario's file as seen from where we are now, not from where the session was."""
    return replace(run, file=from_here(run.file, cwd))


def _invalid(path: Path, message: str, hint: str = "") -> InvalidInput:
    return InvalidInput([Problem(str(path), 0, 0, "SC810", message, hint)])
