"""What the end of a process says about its run."""

import signal
from dataclasses import replace
from pathlib import Path

from simscen.core.result import RunFailure, RunResult, unfinished
from simscen.core.sessionevents import Artifacts, RunFinished
from simscen.judge.resultdata import from_json
from simscen.run.confine import MEMORY_BYTES
from simscen.run.jobs import Job, ProcessEnd
from simscen.run.repeat_command import repeat_command, shown

TAIL_LINES = 20


def answer_to(job: Job, end: ProcessEnd | None) -> RunFinished:
    """The answer to a run. It passed or failed only if its process ended by itself, with status 0 and a last word."""
    failure = _failure(end, job.folder)
    result = _result(job) if failure is None else unfinished(job.key, job.scenario.path, failure)
    return RunFinished(
        result,
        wall=end.wall if end else 0.0,
        artifacts=_artifacts(job.folder),
        again=repeat_command(job.scenario, job.key.seed),
        file=shown(job.scenario.file),
    )


def not_done(job: Job, failure: RunFailure) -> RunFinished:
    """The answer to a run that was never finished, or never begun."""
    result = unfinished(job.key, job.scenario.path, failure)
    return RunFinished(result, again=repeat_command(job.scenario, job.key.seed), file=shown(job.scenario.file))


def _result(job: Job) -> RunResult:
    """What the run says of itself. Its second performance says the same as the first, so the key is ours to give."""
    try:
        return replace(from_json((job.folder / "result.json").read_text(encoding="utf-8")), key=job.key)
    except (OSError, ValueError) as error:
        failure = RunFailure("crashed", f"its result cannot be read: {error}", _tail(job.folder / "worker.log"))
        return unfinished(job.key, job.scenario.path, failure)


def _artifacts(folder: Path) -> Artifacts:
    def path(name: str) -> str:
        return str(folder / name) if (folder / name).exists() else ""

    return Artifacts(str(folder), path("run.mcap"), path("map.png"), path("result.json"))


def _failure(end: ProcessEnd | None, folder: Path) -> RunFailure | None:
    if end is None:
        return RunFailure("crashed", "the process that prepares runs died while this run was under way")
    peak = f"peak memory {end.peak_bytes / 2**20:.0f} MiB of {MEMORY_BYTES / 2**20:.0f} MiB"
    tail = _tail(folder / "worker.log")
    if end.killed_for == "timeout":
        return RunFailure("timeout", f"stopped after {end.wall:.0f} s of wall time", tail)
    if end.signal == signal.SIGKILL:
        return RunFailure("crashed", f"killed (SIGKILL; possibly out of memory; {peak})", tail)
    if end.signal is not None:
        return RunFailure("crashed", f"crashed: {signal.Signals(end.signal).name} ({peak})", tail)
    if end.code != 0:
        return RunFailure("crashed", f"exited {end.code} ({peak})", tail)
    if end.last_word is None:
        return RunFailure("crashed", "exited 0 without a result", tail)
    if "error" in end.last_word:
        return RunFailure(end.last_word["error"], end.last_word["message"], tail)
    if end.left_processes:
        return RunFailure("crashed", "left a process behind, which was killed", tail)
    return None


def _tail(log: Path) -> str:
    try:
        with log.open("rb") as file:
            file.seek(max(0, file.seek(0, 2) - 16_384))
            return "\n".join(file.read().decode(errors="replace").splitlines()[-TAIL_LINES:])
    except OSError:
        return ""
