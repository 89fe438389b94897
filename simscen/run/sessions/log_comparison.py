"""Comparison of the log of a run with the log of an equal run, of the same session or an earlier one."""

import filecmp
from dataclasses import replace
from pathlib import Path

from simscen.core.errors import InvalidInput
from simscen.core.records.run_result import NONDETERMINISTIC, Outcome, RunFailure
from simscen.core.records.session_events import RunFinished
from simscen.judge.result_json import from_json
from simscen.run.sessions.output_folder import run_folder


def compare_with_repetition(run: RunFinished, other: RunFinished | None) -> RunFinished:
    """Return `run`, or an error with the first difference if its log differs from the log of `other`.

    One of the two runs is the repetition of the other. Nothing is compared if `other` is None or a log is missing.
    """
    if other is None or not run.artifacts.mcap or not other.artifacts.mcap:
        return run
    if filecmp.cmp(run.artifacts.mcap, other.artifacts.mcap, shallow=False):
        return run
    from simscen.record.log_reader import read_log
    from simscen.record.trace_difference import first_difference

    logs = [read_log(Path(path)) for path in (other.artifacts.mcap, run.artifacts.mcap)]
    differences = (first_difference(*pair) for pair in zip(*(log.traces for log in logs), strict=False))
    difference = next(filter(None, differences), "the logs differ in something that is not part of the trace")
    return _nondeterministic(run, f"two runs with the same seed differ: {difference}")


def compare_with_session(run: RunFinished, earlier: Path) -> RunFinished:
    """Return the run, or an error if the same run of an earlier session is missing or different.

    `earlier` is the output folder of the earlier session. The verdicts must be equal. The trajectories only need to be
    nearly equal, because the last bits differ between machines. A run that is an error or has no log is not compared.
    """
    if run.result.outcome is Outcome.ERROR or not run.artifacts.mcap:
        return run
    earlier_log = _earlier_run_folder(run, earlier) / "run.mcap"
    try:
        if filecmp.cmp(run.artifacts.mcap, earlier_log, shallow=False):
            return run
        difference = _find_difference(Path(run.artifacts.mcap), earlier_log)
    except OSError as error:
        difference = f"{earlier_log}: {error.strerror}"
    except InvalidInput as error:
        difference = str(error)
    return run if difference is None else _nondeterministic(run, f"not as in {earlier}: {difference}")


def _nondeterministic(run: RunFinished, message: str) -> RunFinished:
    failure = RunFailure(NONDETERMINISTIC, message)
    return replace(run, result=replace(run.result, outcome=Outcome.ERROR, error=failure))


def _earlier_run_folder(run: RunFinished, earlier: Path) -> Path:
    """Return the folder of the same run in an earlier session. The folder name can contain the name of the stack."""
    stack = run.result.stack.partition("=")[0]
    labeled = run_folder(earlier, replace(run.key.original, stack_name=stack))
    return labeled if not run.key.original.stack_name and labeled.is_dir() else run_folder(earlier, run.key.original)


def _find_difference(new_path: Path, earlier_path: Path) -> str | None:
    """Return the verdicts that differ in two logs, or else the first difference of true poses; None without difference.

    Raises InvalidInput for an unreadable log.
    """
    from simscen.record.log_reader import read_log
    from simscen.record.trace_difference import first_pose_difference

    new_log, earlier_log = read_log(new_path), read_log(earlier_path)
    if not earlier_log.result or not new_log.result:
        return f"{earlier_path}: the run did not finish"
    statuses, earlier_statuses = (
        {verdict.id: verdict.status.value for verdict in from_json(log.result).verdicts}
        for log in (new_log, earlier_log)
    )
    changed = [name for name in {**earlier_statuses, **statuses} if statuses.get(name) != earlier_statuses.get(name)]
    differences = [
        f"{name}: {statuses.get(name, 'absent')} instead of {earlier_statuses.get(name, 'absent')}" for name in changed
    ]
    pose_differences = (first_pose_difference(*pair) for pair in zip(new_log.traces, earlier_log.traces, strict=False))
    return "; ".join(differences) or next(filter(None, pose_differences), None)
