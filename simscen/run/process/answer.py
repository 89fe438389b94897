"""What the end of a process says about its run."""

import signal
from dataclasses import replace
from pathlib import Path

from simscen.core.errors import InvalidInput, RunError
from simscen.core.records.run_result import RunFailure, RunResult, error_result, skipped_result
from simscen.core.records.session_events import Artifacts, RunFinished
from simscen.judge.result_json import from_json
from simscen.record.logfile import PARTIAL_SUFFIX
from simscen.run.process.confine import MEMORY_BYTES
from simscen.run.process.jobs import Job, PreparerDeath, ProcessEnd
from simscen.run.process.laststack import innermost, tail
from simscen.run.repeat_command import repeat_command, shown

LARGEST_TO_RECOVER = 64 << 20
"""Bytes of a log that is made whole while other runs wait to be heard: a second or two."""


def answer_to(job: Job, end: ProcessEnd | PreparerDeath) -> RunFinished:
    """The answer to a run. It passed or failed only if its process ended by itself, with status 0 and a last word."""
    failure = _with_log(_failure(end), job.folder)
    printed = tail(end.printed)
    result = (
        _result(job, printed)
        if failure is None
        else error_result(job.key, job.scenario.path, failure, job.scenario.stack)
    )
    return RunFinished(
        result,
        wall=end.wall if isinstance(end, ProcessEnd) else 0.0,
        artifacts=_artifacts(job.folder),
        again=repeat_command(job.scenario, job.key.seed),
        file=shown(job.scenario.file),
        tags=tuple(job.scenario.spec.tags),
    )


def not_done(job: Job, failure: RunFailure) -> RunFinished:
    """The answer to a run that was never finished, or never begun."""
    result = error_result(job.key, job.scenario.path, failure, job.scenario.stack)
    return _told(job, result)


def not_to_do(job: Job, reason: str) -> RunFinished:
    """The answer to a run that its scenario says to skip."""
    result = skipped_result(job.key, job.scenario.path, reason, job.scenario.stack)
    return _told(job, result)


def _told(job: Job, result: RunResult) -> RunFinished:
    """The answer to a run that never began, or was never finished."""
    again, file = repeat_command(job.scenario, job.key.seed), shown(job.scenario.file)
    return RunFinished(result, again=again, file=file, tags=tuple(job.scenario.spec.tags))


def _result(job: Job, said: str) -> RunResult:
    """What the run says of itself. Its second performance says the same as the first, so the key is ours to give."""
    try:
        return replace(from_json((job.folder / "result.json").read_text(encoding="utf-8")), key=job.key)
    except (OSError, ValueError) as error:
        failure = RunFailure("crashed", f"its result cannot be read: {error}", said)
        return error_result(job.key, job.scenario.path, failure, job.scenario.stack)


def _artifacts(folder: Path) -> Artifacts:
    def path(name: str) -> str:
        return str(folder / name) if (folder / name).exists() else ""

    return Artifacts(str(folder), path("run.mcap"), path("map.png"), path("result.json"), path("replay.html"))


def _failure(end: ProcessEnd | PreparerDeath) -> RunFailure | None:
    if isinstance(end, PreparerDeath):
        when = "while it prepared this one" if end.at_fault else "while this run was under way"
        kind = "timeout" if end.timed_out else "crashed"
        return RunFailure(kind, f"the process that prepares runs {end.how} {when}{_place(end)}", tail(end.printed))
    peak = f"peak memory {end.peak_bytes / 2**20:.0f} MiB of {MEMORY_BYTES / 2**20:.0f} MiB"
    if end.killed_for == "timeout":
        return _fault(end, f"stopped after {end.wall:.0f} s of wall time{_place(end)}", "timeout")
    if end.signal == signal.SIGKILL:
        return _fault(end, f"killed (SIGKILL; possibly out of memory; {peak})")
    if end.signal is not None:
        return _fault(end, f"crashed: {signal.Signals(end.signal).name}{_place(end)} ({peak})")
    if end.code != 0:
        return _fault(end, f"exited {end.code} ({peak})")
    if end.last_word is None:
        return _fault(end, "exited 0 without a result")
    if "error" in end.last_word:
        printed = end.last_word.get("tail") or tail(end.printed)
        return RunFailure(end.last_word["error"], end.last_word["message"], printed)
    if end.left_processes:
        return _fault(end, "left a process behind, which was killed")
    return None


def _with_log(failure: RunFailure | None, folder: Path) -> RunFailure | None:
    """The same, with where the log of what happened until then is. What the worker could not finish is finished now."""
    log = folder / f"run{PARTIAL_SUFFIX}"
    if failure is None or not log.exists():
        return failure
    from simscen.record.recover import recover

    how = ""
    if log.stat().st_size > LARGEST_TO_RECOVER:
        how = ", which `simscen log recover` makes whole"
    else:
        try:
            recover(log)
        except (InvalidInput, RunError) as error:
            how = f" ({error})"
    return replace(failure, message=f"{failure.message}; its log until then is {log.name}{how}")


def _fault(end: ProcessEnd, message: str, kind: str = "crashed") -> RunFailure:
    return RunFailure(kind, message, tail(end.printed))


def _place(end: ProcessEnd | PreparerDeath) -> str:
    """Where it was, if it had time to say so."""
    place = innermost(end.printed)
    return f", in {place}" if place else ""
