"""What a run costs beyond its simulation, and what has to be paid before the first one."""

import gc
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from resource import RUSAGE_CHILDREN, getrusage
from tempfile import TemporaryDirectory

from simscen.core.result import RunKey
from simscen.loading.scenario import load_scenario
from simscen.run.bench import PATROL, SEED, Tell, nobody
from simscen.run.figure import Figure, Figures
from simscen.run.outfolder import run_folder
from simscen.run.prepare import prepare
from simscen.run.process.jobs import Job, ProcessEnd
from simscen.run.process.supervisor import Ended, supervise
from simscen.run.simulate import simulate

SHORT = 0.1
"""Simulated seconds of a run that is hardly more than what surrounds it."""
WALL_LIMIT = 300.0
MILLISECONDS, MEGABYTES = "ms", "MB"


@dataclass(frozen=True)
class Overhead:
    """Each of several rounds: CPU ms but where it says wall, MB.

    `run`: assembling, log and verdicts of a run in this process. `process`: the same as a session does it, from the
    fork on, with its picture; `wall` is how long that takes, `memory` the most that its process has used. `preparing`:
    world, map and ways, once for all runs. `start`: importing the engines, once a session. `validate`: the command.
    """

    run: tuple[float, ...]
    process: tuple[float, ...]
    wall: tuple[float, ...]
    memory: tuple[float, ...]
    preparing: tuple[float, ...]
    start: tuple[float, ...]
    validate: tuple[float, ...]

    @property
    def figures(self) -> Figures:
        """Their medians."""
        return {
            "a run beyond its simulation": Figure.of(self.run, MILLISECONDS),
            "the same as a process": Figure.of(self.process, MILLISECONDS),
            "the same as a process, wall time": Figure.of(self.wall, MILLISECONDS),
            "preparing a scenario": Figure.of(self.preparing, MILLISECONDS),
            "start of a session": Figure.of(self.start, MILLISECONDS),
            "simscen validate": Figure.of(self.validate, MILLISECONDS),
            "memory of a worker": Figure.of(self.memory, MEGABYTES),
        }


def measure_overhead(rounds: int, entry: Sequence[str], tell: Tell = nobody) -> Overhead:
    """Runs of the patrol that end at once. `entry` is how Python is called to be a session's warm process."""
    tell("what surrounds a run")
    with TemporaryDirectory() as folder:
        file = short_patrol(Path(folder))
        loaded = load_scenario(file, file.parent)
        prepared = prepare(loaded)
        log = Path(folder, "run.mcap")

        def run() -> object:
            log.unlink(missing_ok=True)
            return simulate(prepared, SEED, log=log)

        run()
        whole = [_cpu(run) for _ in range(rounds)]
        keys = [RunKey(loaded.id, seed + 1) for seed in range(rounds + 1)]
        jobs = [Job(n, loaded, key, run_folder(Path(folder), key), WALL_LIMIT) for n, key in enumerate(keys)]
        ends = [
            end
            for happening in supervise(jobs, 1, entry, lambda: True)
            if isinstance(happening, Ended) and isinstance(end := happening.end, ProcessEnd)
        ]
        others = ends[1:]  # the first waits for the engines to be imported
        return Overhead(
            run=tuple(whole),
            process=tuple(1e3 * end.cpu for end in others),
            wall=tuple(1e3 * end.wall for end in others),
            memory=tuple(end.peak_bytes / 1e6 for end in others),
            preparing=tuple(_cpu(lambda: prepare(loaded)) for _ in range(rounds)),
            start=tuple(_child("-c", f"import {entry[-1]}") for _ in range(rounds)),
            validate=tuple(_child("-m", "simscen", "validate", str(file)) for _ in range(rounds)),
        )


def short_patrol(folder: Path, seconds: float = SHORT) -> Path:
    """The patrol with another time limit."""
    file = folder / "short.scenario.yaml"
    file.write_text(PATROL.read_text(encoding="utf-8").replace("time_limit: 60 s", f"time_limit: {seconds} s"))
    return file


def _cpu(what: Callable[[], object]) -> float:
    """CPU ms of this process for a call."""
    gc.collect()
    begun = time.process_time()
    what()
    return 1e3 * (time.process_time() - begun)


def _child(*arguments: str) -> float:
    """CPU ms of a Python called so."""
    before = getrusage(RUSAGE_CHILDREN)
    subprocess.run([sys.executable, *arguments], check=True, capture_output=True)
    after = getrusage(RUSAGE_CHILDREN)
    return 1e3 * (after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
