"""Merging of the output folders of shards into the output folder of one session.

A shard is a session that ran part i of n of the selected scenarios, for example on one of several machines.
"""

import os
import shutil
from collections.abc import Sequence
from dataclasses import astuple, replace
from pathlib import Path

from simscen.core.errors import InvalidInput, Problem
from simscen.core.records.run_result import RunKey
from simscen.core.records.session_events import Artifacts, RunFinished, RunStarted, SessionFinished
from simscen.report.journal import Journal
from simscen.report.journal_reader import JournaledSession, read_journal


def read_shards(folders: Sequence[Path], allow_missing: bool) -> dict[Path, JournaledSession]:
    """Return the session of the shard in each output folder.

    Raises InvalidInput if different versions of simscen wrote the shards, if two shards contain the same run, or if a
    shard is missing and `allow_missing` is false.
    """
    sessions = {folder: read_journal(folder) for folder in folders}
    folders_by_key: dict[RunKey, Path] = {}
    problems = [] if allow_missing else _missing_shards(sessions)
    first = next(iter(sessions.values()))
    for folder, session in sessions.items():
        if session.version != first.version:
            message = f"this shard was written by simscen {session.version}, but the first shard by {first.version}"
            problems.append(_shard_problem(folder, message))
        for run in session.planned:
            if folders_by_key.setdefault(run.key, folder) != folder:
                message = f"{run.key.test}, seed {run.key.seed} is in {folders_by_key[run.key]} as well"
                problems.append(_shard_problem(folder, message))
    if problems:
        raise InvalidInput(problems)
    return sessions


def _missing_shards(sessions: dict[Path, JournaledSession]) -> list[Problem]:
    """Return a problem for each shard i of n without a session."""
    count = max(session.shard[1] for session in sessions.values())
    present = {session.shard[0] for session in sessions.values() if session.shard[1] == count}
    folder = next(folder for folder, session in sessions.items() if session.shard[1] == count)
    hint = "add its output folder, or use --allow-missing if it had no scenarios"
    missing = sorted(set(range(1, count + 1)) - present)
    return [_shard_problem(folder, f"shard {number}/{count} is missing", hint) for number in missing]


def _shard_problem(folder: Path, message: str, hint: str = "") -> Problem:
    return Problem(str(folder), 0, 0, "SC812", message, hint)


def merge_shards(sessions: dict[Path, JournaledSession], folder: Path, runs_folder: str) -> None:
    """Write one journal for all shards to `folder`, and copy the files of their runs. Raises OSError.

    `runs_folder` is the name of the subfolder with the files of runs in an output folder. Files are hard-linked if the
    file system supports it. The wall time of the merged session is the wall time of the longest shard.
    """
    planned = sorted((run for session in sessions.values() for run in session.planned), key=lambda run: run.key)
    journal = Journal(folder, sync=False)
    try:
        journal.plan(
            planned, next(iter(sessions.values())).version, sum(session.workers for session in sessions.values())
        )
        for source, session in sessions.items():
            if (source / runs_folder).is_dir():
                shutil.copytree(
                    source / runs_folder, folder / runs_folder, copy_function=_link_or_copy, dirs_exist_ok=True
                )
            paths = {run.key: run.path for run in session.planned}
            for key in sorted(session.started):
                journal(RunStarted(key, paths[key]))
            for key in sorted(session.finished):
                journal(_with_moved_files(session.finished[key], source, folder))
        interrupted = any(session.interrupted for session in sessions.values())
        wall = max(session.wall for session in sessions.values())
        journal(SessionFinished(0, 0, 0, simulated=0.0, wall=wall, interrupted=interrupted))
        if journal.error:
            raise journal.error
    finally:
        journal.close()


def _link_or_copy(source: str, target: str) -> None:
    try:
        os.link(source, target)
    except OSError:
        shutil.copy2(source, target)


def _with_moved_files(run: RunFinished, source: Path, folder: Path) -> RunFinished:
    """Return the run with the paths of its files changed from `source` to `folder`."""
    files = (
        str(folder / Path(file).relative_to(source)) if file and Path(file).is_relative_to(source) else file
        for file in astuple(run.artifacts)
    )
    return replace(run, artifacts=Artifacts(*files))
