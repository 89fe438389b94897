"""Build the result of a run from the end of its worker process, and the command that repeats the run."""

import json
import os
import shlex
import signal
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from simscen.core.errors import InvalidInput, RunError
from simscen.core.records.run_result import RunFailure, RunResult, error_result, skipped_result
from simscen.core.records.session_events import Artifacts, RunFinished
from simscen.judge.result_json import from_json
from simscen.loading.files.discovery import default_root
from simscen.loading.loaded import LoadedScenario
from simscen.record.log_file import PARTIAL_SUFFIX
from simscen.run.process.captured_output import innermost_frame, output_tail, signal_name
from simscen.run.process.isolation import MAX_MEMORY_BYTES
from simscen.run.process.jobs import ForkServerDeath, Job, ProcessEnd

MAX_RECOVER_BYTES = 64 << 20
"""Maximum size of a partial log that is recovered during the session."""


def finished_run(job: Job, end: ProcessEnd | ForkServerDeath) -> RunFinished:
    """Return the result of a run after its worker process has ended; an error if the run was not finished."""
    failure = _with_recovered_log(_failure_at_end(end), job.folder)
    output = output_tail(end.output)
    result = (
        _read_result(job, output)
        if failure is None
        else error_result(job.key, job.scenario.path, failure, job.scenario.stack)
    )
    return RunFinished(
        result,
        wall=end.wall if isinstance(end, ProcessEnd) else 0.0,
        artifacts=_existing_artifacts(job.folder),
        again=repeat_command(job.scenario, job.key.seed),
        file=display_path(job.scenario.file),
        tags=tuple(job.scenario.spec.tags),
        warnings=_stack_warnings(job.folder),
    )


def unfinished_run(job: Job, failure: RunFailure) -> RunFinished:
    """Return the result of a run that was interrupted or never started: the error `failure`."""
    result = error_result(job.key, job.scenario.path, failure, job.scenario.stack)
    return _finished_without_log(job, result)


def skipped_run(job: Job, reason: str) -> RunFinished:
    """Return the result of a run that is skipped because its scenario has the key `skip`."""
    result = skipped_result(job.key, job.scenario.path, reason, job.scenario.stack)
    return _finished_without_log(job, result)


def _finished_without_log(job: Job, result: RunResult) -> RunFinished:
    again, file = repeat_command(job.scenario, job.key.seed), display_path(job.scenario.file)
    return RunFinished(result, again=again, file=file, tags=tuple(job.scenario.spec.tags))


def _read_result(job: Job, output: str) -> RunResult:
    """Return the result in result.json, with the key of the job; an error result if the file cannot be read."""
    try:
        return replace(from_json((job.folder / "result.json").read_text(encoding="utf-8")), key=job.key)
    except (OSError, ValueError) as error:
        failure = RunFailure("crashed", f"its result cannot be read: {error}", output)
        return error_result(job.key, job.scenario.path, failure, job.scenario.stack)


def _existing_artifacts(folder: Path) -> Artifacts:
    def path(name: str) -> str:
        return str(folder / name) if (folder / name).exists() else ""

    return Artifacts(str(folder), path("run.mcap"), path("map.png"), path("result.json"), path("replay.html"))


def _stack_warnings(folder: Path) -> tuple[str, ...]:
    """Return the distinct `warnings` of external stacks, which stack.json contains. Ignores incomplete files."""
    warnings: dict[str, None] = {}
    for file in sorted(folder.glob("stack*.json")):
        with suppress(ValueError):  # the worker was killed, or the disk was full
            texts = json.loads(file.read_text(encoding="utf-8")).get("about", {}).get("warnings", [])
            if isinstance(texts, list):
                warnings.update(dict.fromkeys(text for text in texts if isinstance(text, str)))
    return tuple(warnings)


def _failure_at_end(end: ProcessEnd | ForkServerDeath) -> RunFailure | None:
    """Return the failure of a run from the end of its process, or None if the run was finished."""
    if isinstance(end, ForkServerDeath):
        when = "while it prepared this one" if end.was_preparing else "while this run was active"
        kind = "timeout" if end.timed_out else "crashed"
        return RunFailure(
            kind, f"the process that prepares runs {end.description} {when}{_crash_place(end)}", output_tail(end.output)
        )
    peak = f"peak memory {end.peak_bytes / 2**20:.0f} MiB of {MAX_MEMORY_BYTES / 2**20:.0f} MiB"
    if end.killed_for == "timeout":
        return _worker_failure(end, f"stopped after {end.wall:.0f} s of wall time{_crash_place(end)}", "timeout")
    if end.signal == signal.SIGKILL:
        return _worker_failure(end, f"killed (SIGKILL; possibly out of memory; {peak})")
    if end.signal is not None:
        return _worker_failure(end, f"crashed: {signal_name(end.signal)}{_crash_place(end)} ({peak})")
    if end.code != 0:
        return _worker_failure(end, f"exited {end.code} ({peak})")
    if end.final_message is None:
        return _worker_failure(end, "exited 0 without a result")
    if "error" in end.final_message:
        output = end.final_message.get("tail") or output_tail(end.output)
        by_stack = end.final_message.get("by_stack", False)
        return RunFailure(end.final_message["error"], end.final_message["message"], output, by_stack)
    if end.left_processes:
        return _worker_failure(end, "left a process behind, which was killed")
    return None


def _with_recovered_log(failure: RunFailure | None, folder: Path) -> RunFailure | None:
    """Recover the partial log of a failed run, and return the failure with the name of the log in its message."""
    log = folder / f"run{PARTIAL_SUFFIX}"
    if failure is None or not log.exists():
        return failure
    from simscen.record.log_recovery import recover

    note = ""
    if log.stat().st_size > MAX_RECOVER_BYTES:
        note = ", which `simscen log recover` can recover"
    else:
        try:
            recover(log)
        except (InvalidInput, RunError) as error:
            note = f" ({error})"
    return replace(failure, message=f"{failure.message}; its log until then is {log.name}{note}")


def _worker_failure(end: ProcessEnd, message: str, kind: str = "crashed") -> RunFailure:
    return RunFailure(kind, message, output_tail(end.output))


def _crash_place(end: ProcessEnd | ForkServerDeath) -> str:
    """Return ", in FRAME" with the innermost Python frame if the process wrote its traceback, else ""."""
    place = innermost_frame(end.output)
    return f", in {place}" if place else ""


def repeat_command(scenario: LoadedScenario, seed: int) -> str:
    """Return the shell command that repeats a run from the working folder; "" if no command does."""
    if scenario.key(seed).is_proposal:
        return ""
    words = ["simscen", "run", display_path(scenario.file), "--seed", str(seed)]
    if scenario.variation:
        words += ["--variation", scenario.variation]
    if scenario.root != default_root([scenario.file]):
        words += ["--root", display_path(scenario.root)]
    for folder in scenario.world_path:
        words += ["--world-path", display_path(folder)]
    if scenario.choice is not None:
        choice = scenario.choice
        words += [
            "--stack",
            choice.option_text if choice.file is None else f"{choice.name}={display_path(choice.file)}",
        ]
    return shlex.join([*words, *(["--lenient"] if scenario.lenient else [])])


def display_path(path: Path) -> str:
    """Return the path relative to the working folder or the absolute path, whichever is shorter."""
    return min(os.path.relpath(path), str(path), key=len)
