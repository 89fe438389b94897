"""Measurement of the overhead of a run: setup, process, and external stack."""

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
from simscen.bench.speed.run_speed import PATROL, SEED, ProgressCallback
from simscen.core.records.run_result import RunKey
from simscen.core.records.trace import Moment
from simscen.loading.scenario import load_scenario
from simscen.record.moment_buffer import MomentSink
from simscen.run.external.build import with_external_reference
from simscen.run.lockstep import RunSetup
from simscen.run.preparation import PreparedScenario, prepare
from simscen.run.process.jobs import Ended, Job, ProcessEnd
from simscen.run.process.supervisor import Supervisor
from simscen.run.sessions.output_folder import run_folder
from simscen.run.simulate import simulate

SHORT_RUN_S = 0.1
"""Simulated time of the run for `measure_overhead`."""
WALL_LIMIT_S = 300.0
"""Wall time after which the supervisor ends a measured run."""


@dataclass(frozen=True)
class Overhead:
    """Overhead of runs, with one value for each round. The names of the fields are keys of the JSON output.

    run:       CPU time in ms of a run of SHORT_RUN_S in this process
    outside_simulation: the part of `run` outside the simulation, in ms: setup, log file, and verdicts
    process:   CPU time in ms of the same run in its own process, from the fork on, including its picture
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
            f"a run of {SHORT_RUN_S} s": Measurement.from_rounds(self.run, "ms"),
            "of that outside the simulation": Measurement.from_rounds(self.outside_simulation, "ms"),
            "the same as a process": Measurement.from_rounds(self.process, "ms"),
            "the same as a process, wall time": Measurement.from_rounds(self.wall, "ms"),
            "preparing a scenario": Measurement.from_rounds(self.preparing, "ms"),
            "start of a session": Measurement.from_rounds(self.start, "ms"),
            "simscen validate": Measurement.from_rounds(self.validate, "ms"),
            "memory of a worker": Measurement.from_rounds(self.memory, "MB"),
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


def measure_overhead(rounds: int, fork_server_args: Sequence[str], report_progress: ProgressCallback) -> Overhead:
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


def short_patrol(folder: Path) -> Path:
    """Write PATROL with the time limit SHORT_RUN_S, and return the scenario file."""
    file = folder / "short.scenario.yaml"
    file.write_text(PATROL.read_text(encoding="utf-8").replace("time_limit: 60 s", f"time_limit: {SHORT_RUN_S} s"))
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


@dataclass(frozen=True)
class ExternalStackCost:
    """Mean wall time in µs that a run waits for the stack per beat (recorded tick), over `cycles` beats.

    `in_process_us` is for a stack in the process of the run, `external_us` for a stack in another process. The names of
    the fields are keys of the JSON output.
    """

    cycles: int
    in_process_us: float
    external_us: float

    @property
    def ratio(self) -> float:
        """`external_us` divided by `in_process_us`."""
        return self.external_us / self.in_process_us


def measure_external(rounds: int) -> ExternalStackCost:
    """Run PATROL `rounds` times with the stack in this process, and as often with the stack in another process."""
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
