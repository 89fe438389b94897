"""What a run costs beyond its simulation, and what has to be paid before the first one."""

import gc
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from resource import RUSAGE_CHILDREN, getrusage
from tempfile import TemporaryDirectory

from simscen.bench.speed.measurement import Measurement, Measurements
from simscen.bench.speed.run_speed import PATROL, SEED, ProgressCallback, bare_patrol, no_progress
from simscen.core.records.run_result import RunKey
from simscen.core.records.session_events import RunFinished
from simscen.core.records.trace import Moment
from simscen.loading.loaded import LoadedScenario
from simscen.loading.plugins import plugins_of_all
from simscen.loading.scenario import load_scenario
from simscen.record.recorder import MomentSink
from simscen.run.lockstep import RunSetup
from simscen.run.preparation.scenario import prepare
from simscen.run.process.isolation import plugin_path_arguments
from simscen.run.process.jobs import Job, ProcessEnd
from simscen.run.process.supervisor import Ended, supervise
from simscen.run.sessions.output_folder import run_folder
from simscen.run.sessions.results import finished_run
from simscen.run.sessions.run_session import SessionOptions, plan_jobs
from simscen.run.simulate import simulate

SHORT = 0.1
"""Simulated seconds of a run that is hardly more than what surrounds it."""
WALL_LIMIT = 300.0
MILLISECONDS, MEGABYTES = "ms", "MB"


@dataclass(frozen=True)
class Overhead:
    """Each of several rounds: CPU ms but where it says wall, MB.

    `run`: a run of SHORT in this process. `beyond`: what of that lies outside of its beats: assembling, the log's
    beginning and end, verdicts. `process`: the same run as a session does it, from the fork on, with its picture;
    `wall` is how long that takes, `memory` the most that its process has used. `preparing`: world, map and ways, once
    for all runs. `start`: importing the engines, once a session. `validate`: the command.
    """

    run: tuple[float, ...]
    beyond: tuple[float, ...]
    process: tuple[float, ...]
    wall: tuple[float, ...]
    memory: tuple[float, ...]
    preparing: tuple[float, ...]
    start: tuple[float, ...]
    validate: tuple[float, ...]

    @property
    def figures(self) -> Measurements:
        """Their medians."""
        return {
            f"a run of {SHORT} s": Measurement.of(self.run, MILLISECONDS),
            "of that beyond its simulation": Measurement.of(self.beyond, MILLISECONDS),
            "the same as a process": Measurement.of(self.process, MILLISECONDS),
            "the same as a process, wall time": Measurement.of(self.wall, MILLISECONDS),
            "preparing a scenario": Measurement.of(self.preparing, MILLISECONDS),
            "start of a session": Measurement.of(self.start, MILLISECONDS),
            "simscen validate": Measurement.of(self.validate, MILLISECONDS),
            "memory of a worker": Measurement.of(self.memory, MEGABYTES),
        }


class _Beats:
    """CPU ms that a run takes from its first beat to its last: its simulation, with the first plan."""

    def attach(self, rig: RunSetup, own: Sequence[MomentSink]) -> Sequence[MomentSink]:
        """The run begins."""
        self.begun = self.ended = time.process_time()
        return (self,)

    def append(self, moment: Moment) -> None:
        """Another beat has passed."""
        self.ended = time.process_time()

    @property
    def took(self) -> float:
        """Of the last run."""
        return 1e3 * (self.ended - self.begun)


def measure_overhead(rounds: int, entry: Sequence[str], tell: ProgressCallback = no_progress) -> Overhead:
    """Runs of the patrol that end at once. `entry` is how Python is called to be a session's warm process."""
    tell("what surrounds a run")
    with TemporaryDirectory() as folder:
        file = short_patrol(Path(folder))
        loaded = load_scenario(file, file.parent)
        prepared = prepare(loaded)
        log = Path(folder, "run.mcap")

        beats = _Beats()

        def run() -> object:
            log.unlink(missing_ok=True)
            return simulate(prepared, SEED, log=log, attach=beats.attach)

        run()
        each = [(_cpu(run), beats.took) for _ in range(rounds)]
        keys = [RunKey(loaded.id, seed + 1) for seed in range(rounds + 1)]
        jobs = [Job(n, loaded, key, run_folder(Path(folder), key), WALL_LIMIT) for n, key in enumerate(keys)]
        ends = [
            end
            for happening in supervise(jobs, 1, entry, lambda: True)
            if isinstance(happening, Ended) and isinstance(end := happening.end, ProcessEnd)
        ]
        others = ends[1:]  # the first waits for the engines to be imported
        return Overhead(
            run=tuple(whole for whole, _ in each),
            beyond=tuple(whole - simulated for whole, simulated in each),
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


# MERGED: How fast a suite of scenarios is run on all cores, beside PyBullet stepping and scanning as long.
BARE_SECONDS = 60.0


@dataclass(frozen=True)
class Suite:
    """So many runs of so many `simulated` seconds in all, on `workers` cores, from the session's start to its end.

    `wall` and `cpu` in seconds, the latter of all runs; `memory` is the most that each run's process has used, in MB;
    `bare` is the CPU seconds that PyBullet alone takes on one core for a simulated second of the patrol, measured
    before and after. `unfinished` are the runs that broke off.
    """

    runs: int
    unfinished: tuple[str, ...]
    workers: int
    simulated: float
    wall: float
    cpu: float
    memory: tuple[float, ...]
    bare: float

    @property
    def figures(self) -> Measurements:
        """What is compared."""
        alone = self.bare * self.simulated
        return {
            "suite: runs a minute": Measurement(60 * self.runs / self.wall, "", more_is_better=True),
            "suite: wall time": Measurement(self.wall, "s"),
            "suite: wall time, times PyBullet alone on one core": Measurement(self.wall / alone, ""),
            "suite: CPU time, times PyBullet alone": Measurement(self.cpu / alone, ""),
            "suite: memory of a worker": Measurement(statistics.median(self.memory), "MB"),
            "suite: memory of the largest worker": Measurement(max(self.memory), "MB"),
        }


def evenly_spaced(scenarios: Sequence[LoadedScenario], most: int) -> list[LoadedScenario]:
    """At most so many, evenly taken from all."""
    if len(scenarios) <= most:
        return list(scenarios)
    return [scenarios[number * len(scenarios) // most] for number in range(most)]


def measure_suite(
    scenarios: Sequence[LoadedScenario],
    workers: int,
    out: Path,
    entry: Sequence[str],
    tell: ProgressCallback = no_progress,
) -> Suite:
    """Run each scenario once, recorded as always. `entry` is how Python is called to be the warm process."""
    patrol = prepare(load_scenario(PATROL, PATROL.parent))
    bares = [bare_patrol(patrol, BARE_SECONDS)]
    begun = time.perf_counter()
    jobs = plan_jobs(scenarios, SessionOptions(workers=workers), out)
    told = plugin_path_arguments(plugins_of_all(scenarios))
    answers, ends = list[RunFinished](), list[ProcessEnd]()
    for happening in supervise(jobs, workers, (*entry, *told), lambda: True):
        if isinstance(happening, Ended):
            answers.append(finished_run(happening.job, happening.end))
            if isinstance(happening.end, ProcessEnd):
                ends.append(happening.end)
            tell(f"{len(answers)} of {len(jobs)} runs")
    wall = time.perf_counter() - begun
    bares.append(bare_patrol(patrol, BARE_SECONDS))
    return Suite(
        runs=len(jobs),
        unfinished=tuple(answer.key.test for answer in answers if answer.result.error is not None),
        workers=workers,
        simulated=sum(answer.result.simulated for answer in answers),
        wall=wall,
        cpu=sum(end.cpu for end in ends),
        memory=tuple(end.peak_bytes / 1e6 for end in ends),
        bare=statistics.mean(bares) / BARE_SECONDS,
    )
