"""Outcomes of the same runs in earlier sessions."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from typing import Any

from simscen.core.records.run_result import Outcome, RunKey
from simscen.core.records.session_events import RunFinished
from simscen.judge.result_json import read_key
from simscen.report.journal_reader import sessions_in

MAX_SESSIONS = 10
"""Maximum number of earlier sessions to show."""
MAX_RESULTS_BYTES = 64 << 20
"""Maximum size of a results.json to read."""


@dataclass(frozen=True)
class PastOutcome:
    """Outcome of a run in an earlier session, with its simulated seconds."""

    outcome: Outcome
    simulated: float


@dataclass(frozen=True)
class PastSession:
    """An earlier session: the name of its folder, and the outcomes of its runs."""

    name: str
    runs: Mapping[RunKey, PastOutcome] = field(default_factory=dict)

    def number(self, *outcomes: Outcome) -> int:
        """Return the number of runs with one of these outcomes."""
        return sum(run.outcome in outcomes for run in self.runs.values())


def past_sessions(folder: Path) -> list[PastSession]:
    """Return the sessions next to the output folder that are older than it, newest first."""
    folders = sessions_in(folder.absolute().parent)
    index = next((k for k, each in enumerate(folders) if each.name == folder.absolute().name), -1)
    sessions = (past for each in folders[index + 1 :] if (past := _read(each)) is not None)
    return list(islice(sessions, MAX_SESSIONS))


def _read(folder: Path) -> PastSession | None:
    """Read results.json of a session. Return None if it is missing, too large, or from another version."""
    try:
        file = folder / "results.json"
        if file.stat().st_size > MAX_RESULTS_BYTES:
            return None
        document: dict[str, Any] = json.loads(file.read_text(encoding="utf-8"))
        runs = {
            read_key(run): PastOutcome(Outcome(run["outcome"]), float(run["simulated_seconds"]))
            for run in document["runs"]
        }
    except (OSError, ValueError, KeyError, TypeError):
        return None
    return PastSession(folder.name, runs)


def past_outcomes(run: RunFinished, past: Sequence[PastSession]) -> list[PastOutcome | None]:
    """Return the outcomes of a run in earlier sessions, oldest first; None for sessions without the run."""
    return [session.runs.get(run.key) for session in reversed(past)]


def outcome_change(run: RunFinished, past: Sequence[PastSession]) -> str:
    """Return the previous outcome of a run if it has changed, for example "failed before", or ""."""
    known = [outcome for outcome in past_outcomes(run, past) if outcome is not None]
    if not known or known[-1].outcome.good == run.outcome.good:
        return ""
    return f"{known[-1].outcome.value.replace('-', ' ')} before"
