"""What sessions before this one said of the same runs."""

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
"""So many sessions are looked back on."""
MAX_RESULTS_BYTES = 64 << 20
"""Bytes of a results.json that is still read."""


@dataclass(frozen=True)
class PastOutcome:
    """How a run came out in a session, and how many seconds it simulated."""

    outcome: Outcome
    simulated: float


@dataclass(frozen=True)
class PastSession:
    """An earlier session: the name of its folder, and its runs."""

    name: str
    runs: Mapping[RunKey, PastOutcome] = field(default_factory=dict)

    def number(self, *outcomes: Outcome) -> int:
        """How many of its runs came out so."""
        return sum(before.outcome in outcomes for before in self.runs.values())


def past_sessions(folder: Path) -> list[PastSession]:
    """The sessions beside the output folder that are older than it, the newest first."""
    beside = sessions_in(folder.absolute().parent)
    own = next((place for place, each in enumerate(beside) if each.name == folder.absolute().name), -1)
    found = (past for each in beside[own + 1 :] if (past := _read(each)) is not None)
    return list(islice(found, MAX_SESSIONS))


def _read(folder: Path) -> PastSession | None:
    """What its results.json says; None of one that was killed, or that another version wrote."""
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
    """What became of a run, in the sessions from the oldest to the one before this; None where it was not run."""
    return [session.runs.get(run.key) for session in reversed(past)]


def outcome_change(run: RunFinished, past: Sequence[PastSession]) -> str:
    """How a run came out when it was run last, where that was otherwise: "failed before"; else ""."""
    known = [before for before in past_outcomes(run, past) if before is not None]
    if not known or known[-1].outcome.good == run.outcome.good:
        return ""
    return f"{known[-1].outcome.value.replace('-', ' ')} before"
