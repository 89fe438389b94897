"""What the end of a process says about its run."""

import signal
from pathlib import Path

from simscen.core.session import Artifacts, Outcome, RunFailure, RunFinished, RunKey
from simscen.judge.result import read_result
from simscen.loading.loaded import LoadedScenario
from simscen.run.confine import MEMORY_BYTES
from simscen.run.jobs import ProcessEnd

TAIL_LINES = 20


def told(key: RunKey, scenario: LoadedScenario, folder: Path, exit_: ProcessEnd | None) -> RunFinished:
    """The answer to a run. It passed or failed only if its process ended by itself, with status 0 and a last word."""
    failure = _failure(exit_, folder)
    wall = exit_.wall if exit_ else 0.0
    if failure:
        artifacts = Artifacts(folder=str(folder))
        return RunFinished(
            key, scenario.path, 1, Outcome.ERROR, wall=wall, artifacts=artifacts, error=failure, again=again(key, scenario)
        )
    result = read_result(folder / "result.json")
    return RunFinished(
        key=key,
        path=scenario.path,
        line=1,
        outcome=result.outcome,
        verdicts=result.verdicts,
        lines=tuple(scenario.place_of("pass", index)[0] for index in range(len(result.verdicts))),
        simulated=result.simulated,
        wall=wall,
        ended=result.ended,
        metrics=tuple(sorted(result.metrics.items())),
        artifacts=_artifacts(folder),
        again=again(key, scenario),
    )


def again(key: RunKey, scenario: LoadedScenario) -> str:
    """The command that repeats a run."""
    return f"simscen run {scenario.path} --seed {key.seed}"


def _artifacts(folder: Path) -> Artifacts:
    def path(name: str) -> str:
        return str(folder / name) if (folder / name).exists() else ""

    return Artifacts(str(folder), path("run.mcap"), path("map.png"), path("result.json"))


def _failure(exit_: ProcessEnd | None, folder: Path) -> RunFailure | None:
    if exit_ is None:
        return RunFailure("crashed", "the process that prepares runs died while this run was under way")
    peak = f"peak memory {exit_.peak_bytes / 2**20:.0f} MiB of {MEMORY_BYTES / 2**20:.0f} MiB"
    tail = _tail(folder / "worker.log")
    if exit_.killed_for == "timeout":
        return RunFailure("timeout", f"stopped after {exit_.wall:.0f} s of wall time", tail)
    if exit_.signal == signal.SIGKILL:
        return RunFailure("crashed", f"killed (SIGKILL; possibly out of memory; {peak})", tail)
    if exit_.signal is not None:
        return RunFailure("crashed", f"crashed: {signal.Signals(exit_.signal).name} ({peak})", tail)
    if exit_.code != 0:
        return RunFailure("crashed", f"exited {exit_.code} ({peak})", tail)
    if exit_.end is None:
        return RunFailure("crashed", "exited 0 without a result", tail)
    if "error" in exit_.end:
        return RunFailure(exit_.end["error"], exit_.end["message"], tail)
    if exit_.left_processes:
        return RunFailure("crashed", "left a process behind, which was killed", tail)
    return None


def _tail(log: Path) -> str:
    try:
        with log.open("rb") as file:
            file.seek(max(0, file.seek(0, 2) - 16_384))
            return "\n".join(file.read().decode(errors="replace").splitlines()[-TAIL_LINES:])
    except OSError:
        return ""
