"""Measurement of the overhead of runs (setup, process, external stack), and of the time of a session with many runs."""

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

from simscen.bench.speed.measurement import Measurement, Measurements, Stopwatch
from simscen.bench.speed.run_speed import PATROL, SEED, ProgressCallback, no_progress, time_baseline_patrol
from simscen.core.records.run_result import RunKey
from simscen.core.records.session_events import RunFinished
from simscen.core.records.trace import Moment
from simscen.loading.loaded import LoadedScenario
from simscen.loading.plugins import plugins_of_all
from simscen.loading.scenario import load_scenario
from simscen.record.moment_buffer import MomentSink
from simscen.run.external.stack import with_external_reference
from simscen.run.lockstep import RunSetup
from simscen.run.preparation import PreparedScenario, prepare
from simscen.run.process.jobs import Ended, Job, ProcessEnd
from simscen.run.process.supervisor import Supervisor
from simscen.run.sessions.output_folder import run_folder
from simscen.run.sessions.results import finished_run
from simscen.run.sessions.run_session import SessionOptions, plan_jobs
from simscen.run.simulate import simulate

SHORT_RUN_S = 0.1
"""Simulated time of the run for `measure_overhead`."""
WALL_LIMIT_S = 300.0
"""Wall time after which the supervisor ends a measured run."""
MILLISECONDS, MEGABYTES = "ms", "MB"


@dataclass(frozen=True)
class Overhead:
    """Overhead of runs, with one value for each round. The names of the fields are keys of the JSON output.

    run:       CPU time in ms of a run of SHORT_RUN_S in this process
    outside_simulation: the part of `run` outside the simulation, in ms: setup, log file, and verdicts
    process:   CPU time in ms of such a run in its own process, from the fork on, including its picture
    wall:      wall time in ms of the run in its own process
    memory:    maximum memory in MB of the run in its own process
    preparing: CPU time in ms for preparing the scenario: world, map, and shortest paths
    start:     CPU time in ms for importing the modules of the fork server
    validate:  CPU time in ms of `simscen validate`
    """

    run: tuple[float, ...]
    outside_simulation: tuple[float, ...]
    process: tuple[float, ...]
    wall: tuple[float, ...]
    memory: tuple[float, ...]
    preparing: tuple[float, ...]
    start: tuple[float, ...]
    validate: tuple[float, ...]

    @property
    def figures(self) -> Measurements:
        """Median of each field by printed name."""
        return {
            f"a run of {SHORT_RUN_S} s": Measurement.of(self.run, MILLISECONDS),
            "of that outside the simulation": Measurement.of(self.outside_simulation, MILLISECONDS),
            "the same as a process": Measurement.of(self.process, MILLISECONDS),
            "the same as a process, wall time": Measurement.of(self.wall, MILLISECONDS),
            "preparing a scenario": Measurement.of(self.preparing, MILLISECONDS),
            "start of a session": Measurement.of(self.start, MILLISECONDS),
            "simscen validate": Measurement.of(self.validate, MILLISECONDS),
            "memory of a worker": Measurement.of(self.memory, MEGABYTES),
        }


class _BeatTimer:
    """Listener that counts the beats (recorded ticks) of a run, and measures the CPU time up to the last beat."""

    def attach(self, setup: RunSetup, listeners: Sequence[MomentSink]) -> Sequence[MomentSink]:
        """Start the timer, and return the timer as a further listener of the run."""
        self.start = self.end = time.process_time()
        self.count = 0
        return (self,)

    def append(self, moment: Moment) -> None:
        """Count the beat at which this moment was recorded."""
        self.end = time.process_time()
        self.count += 1

    @property
    def duration(self) -> float:
        """CPU time from `attach` to the last beat in ms."""
        return 1e3 * (self.end - self.start)


def measure_overhead(
    rounds: int, fork_server_args: Sequence[str], report_progress: ProgressCallback = no_progress
) -> Overhead:
    """Measure the overhead of short runs. `fork_server_args` are the arguments of Python that start the fork server."""
    report_progress("overhead of a run")
    with TemporaryDirectory() as folder:
        file = short_patrol(Path(folder))
        loaded = load_scenario(file, file.parent)
        prepared = prepare(loaded)
        log = Path(folder, "run.mcap")

        timer = _BeatTimer()

        def run() -> object:
            log.unlink(missing_ok=True)
            return simulate(prepared, SEED, log=log, attach=timer.attach)

        run()
        durations = [(_cpu_ms(run), timer.duration) for _ in range(rounds)]
        keys = [RunKey(loaded.id, seed + 1) for seed in range(rounds + 1)]
        jobs = [Job(n, loaded, key, run_folder(Path(folder), key), WALL_LIMIT_S) for n, key in enumerate(keys)]
        with Supervisor(1, fork_server_args) as supervisor:
            ends = [
                end
                for update in supervisor.run(jobs)
                if isinstance(update, Ended) and isinstance(end := update.end, ProcessEnd)
            ]
        measured = ends[1:]  # the first run includes the import of the engines
        return Overhead(
            run=tuple(whole for whole, _ in durations),
            outside_simulation=tuple(whole - simulated for whole, simulated in durations),
            process=tuple(1e3 * end.cpu for end in measured),
            wall=tuple(1e3 * end.wall for end in measured),
            memory=tuple(end.peak_bytes / 1e6 for end in measured),
            preparing=tuple(_cpu_ms(lambda: prepare(loaded)) for _ in range(rounds)),
            start=tuple(_child_cpu_ms("-c", f"import {fork_server_args[-1]}") for _ in range(rounds)),
            validate=tuple(_child_cpu_ms("-m", "simscen", "validate", str(file)) for _ in range(rounds)),
        )


def short_patrol(folder: Path, seconds: float = SHORT_RUN_S) -> Path:
    """Write PATROL with this time limit, and return the scenario file."""
    file = folder / "short.scenario.yaml"
    file.write_text(PATROL.read_text(encoding="utf-8").replace("time_limit: 60 s", f"time_limit: {seconds} s"))
    return file


def _cpu_ms(call: Callable[[], object]) -> float:
    """Return the CPU time of a call in ms."""
    gc.collect()
    start = time.process_time()
    call()
    return 1e3 * (time.process_time() - start)


def _child_cpu_ms(*arguments: str) -> float:
    """Return the CPU time in ms of a Python process with these command-line arguments."""
    before = getrusage(RUSAGE_CHILDREN)
    subprocess.run([sys.executable, *arguments], check=True, capture_output=True)
    after = getrusage(RUSAGE_CHILDREN)
    return 1e3 * (after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)


BASELINE_DURATION_S = 60.0
"""Simulated time of each measurement of the PyBullet baseline."""


@dataclass(frozen=True)
class SuiteResult:
    """Time and memory of a session with one run for each scenario. The names of the fields are keys of the JSON output.

    runs:       number of runs
    unfinished: names of the scenarios and variations with an aborted run
    workers:    number of parallel processes
    simulated:  simulated time of all runs in s
    wall:       wall time of the session in s
    cpu:        CPU time of all runs in s
    memory:     maximum memory of the process of each run in MB
    baseline:   CPU time in s of the PyBullet baseline per simulated second
    """

    runs: int
    unfinished: tuple[str, ...]
    workers: int
    simulated: float
    wall: float
    cpu: float
    memory: tuple[float, ...]
    baseline: float

    @property
    def figures(self) -> Measurements:
        """All figures of the suite by printed name."""
        baseline_s = self.baseline * self.simulated
        return {
            "suite: runs a minute": Measurement(60 * self.runs / self.wall, "", more_is_better=True),
            "suite: wall time": Measurement(self.wall, "s"),
            "suite: wall time, times PyBullet alone on one core": Measurement(self.wall / baseline_s, ""),
            "suite: CPU time, times PyBullet alone": Measurement(self.cpu / baseline_s, ""),
            "suite: memory of a worker": Measurement(statistics.median(self.memory), "MB"),
            "suite: memory of the largest worker": Measurement(max(self.memory), "MB"),
        }


def evenly_spaced(scenarios: Sequence[LoadedScenario], max_count: int) -> list[LoadedScenario]:
    """Return at most `max_count` of the scenarios, evenly spaced in the sequence."""
    if len(scenarios) <= max_count:
        return list(scenarios)
    return [scenarios[number * len(scenarios) // max_count] for number in range(max_count)]


def measure_suite(
    scenarios: Sequence[LoadedScenario],
    workers: int,
    out: Path,
    fork_server_args: Sequence[str],
    report_progress: ProgressCallback = no_progress,
) -> SuiteResult:
    """Measure a session that runs each scenario once and writes to the folder `out`.

    `fork_server_args` are the arguments of Python that start the fork server.
    """
    patrol = prepare(load_scenario(PATROL, PATROL.parent))
    baselines = [time_baseline_patrol(patrol, BASELINE_DURATION_S)]
    start = time.perf_counter()
    jobs = plan_jobs(scenarios, SessionOptions(workers=workers), out)
    finished_runs, ends = list[RunFinished](), list[ProcessEnd]()
    with Supervisor(workers, fork_server_args) as supervisor:
        for update in supervisor.run(jobs, plugins_of_all(scenarios)):
            if isinstance(update, Ended):
                finished_runs.append(finished_run(update.job, update.end))
                if isinstance(update.end, ProcessEnd):
                    ends.append(update.end)
                report_progress(f"{len(finished_runs)} of {len(jobs)} runs")
    wall = time.perf_counter() - start
    baselines.append(time_baseline_patrol(patrol, BASELINE_DURATION_S))
    return SuiteResult(
        runs=len(jobs),
        unfinished=tuple(finished.key.test for finished in finished_runs if finished.result.error is not None),
        workers=workers,
        simulated=sum(finished.result.simulated for finished in finished_runs),
        wall=wall,
        cpu=sum(end.cpu for end in ends),
        memory=tuple(end.peak_bytes / 1e6 for end in ends),
        baseline=statistics.mean(baselines) / BASELINE_DURATION_S,
    )


@dataclass(frozen=True)
class ExternalStackCost:
    """Mean wall time in µs that a run waits for the stack per beat (recorded tick), over `cycles` beats.

    `in_process_us` is for a stack in the process of the run, `external_us` for a stack in another process.
    """

    cycles: int
    in_process_us: float
    external_us: float

    @property
    def ratio(self) -> float:
        """`external_us` divided by `in_process_us`."""
        return self.external_us / self.in_process_us


def measure_external(rounds: int) -> ExternalStackCost:
    """Run PATROL `rounds` times with the stack in this process, and `rounds` times with the stack in another one."""
    prepared = prepare(load_scenario(PATROL, PATROL.parent))
    in_process = [_wait_per_beat(prepared) for _ in range(rounds)]
    external = [_wait_per_beat(with_external_reference(prepared)) for _ in range(rounds)]
    return ExternalStackCost(
        in_process[0][0], statistics.median(us for _, us in in_process), statistics.median(us for _, us in external)
    )


def _wait_per_beat(prepared: PreparedScenario) -> tuple[int, float]:
    """Return the number of beats of a run, and the mean wall time in µs that the run waits for the stack per beat."""
    watch, timer = Stopwatch(), _BeatTimer()

    def attach(setup: RunSetup, listeners: Sequence[MomentSink]) -> Sequence[MomentSink]:
        watch.watch("stack", setup.robots[0].stack, "decide")
        return timer.attach(setup, listeners)

    simulate(prepared, SEED, attach=attach)
    return timer.count, 1e6 * watch.seconds["stack"] / timer.count
