"""The sessions that an output folder holds, and what of them failed last."""

import json
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import islice
from pathlib import Path

from simscen.core.errors import InvalidInput
from simscen.core.records.run_result import RunKey
from simscen.report.journaldata import NAME
from simscen.report.rebuild import read_journal

MOST = 50
"""So many sessions are looked back on."""
UNDECIDED = frozenset({"interrupted", "not-run"})
"""Kinds of runs that say nothing of their scenario; the session before them does."""


@dataclass(frozen=True)
class LastFailed:
    """The `runs` whose latest outcome was none as it should be, and the newest session's `folder`."""

    folder: Path
    runs: frozenset[RunKey]


def sessions_in(folder: Path) -> list[Path]:
    """The output folders of sessions below `folder`, the newest first; links such as `latest` are left out."""
    if not folder.is_dir():
        return []
    found = [each for each in folder.iterdir() if (each / NAME).is_file() and not each.is_symlink()]
    return sorted(found, key=lambda each: (_written(each), (each / NAME).stat().st_mtime_ns, each.name), reverse=True)


def last_failed(folder: Path) -> LastFailed | None:
    """What failed when it was run last, in any of the sessions of `folder`, as pytest remembers it; None = no session.

    A run that later sessions left out is still as it was then.
    """
    sessions = sessions_in(folder)
    if not sessions:
        return None
    known: dict[RunKey, bool] = {}
    for session in islice(sessions, MOST):
        found: dict[RunKey, bool] = {}
        for key, good in _outcomes(session):
            found[key.first] = found.get(key.first, True) and good
        known = {**found, **known}
    return LastFailed(sessions[0], frozenset(key for key, good in known.items() if not good))


def _outcomes(session: Path) -> Iterator[tuple[RunKey, bool]]:
    """Each run that came to an end, and whether as it should; none of a journal that cannot be read."""
    try:
        answers = read_journal(session).answers
    except InvalidInput:
        return
    for answer in answers:
        if answer.result.error is None or answer.result.error.kind not in UNDECIDED:
            yield answer.key, answer.outcome.good


def _written(session: Path) -> str:
    """When run.json says that it was, in ISO 8601; "" where it does not."""
    try:
        document = json.loads((session / "run.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return ""
    return str(document.get("written", "")) if isinstance(document, dict) else ""
