"""Measurement of the time and memory of a session with many runs."""

import statistics
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from simscen.bench.speed.measurement import Measurement, Measurements
from simscen.bench.speed.run_speed import PATROL, ProgressCallback, time_baseline_patrol
from simscen.core.records.session_events import RunFinished
from simscen.loading.loaded import LoadedScenario
from simscen.loading.plugins import plugins_of_all
from simscen.loading.scenario import load_scenario
from simscen.run.preparation import prepare
from simscen.run.process.jobs import Ended, ProcessEnd
from simscen.run.process.supervisor import Supervisor
from simscen.run.sessions.results import finished_run
from simscen.run.sessions.run_session import SessionOptions, plan_jobs

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
    count = min(max_count, len(scenarios))
    return [scenarios[number * len(scenarios) // count] for number in range(count)]


def measure_suite(
    scenarios: Sequence[LoadedScenario],
    workers: int,
    out: Path,
    fork_server_args: Sequence[str],
    report_progress: ProgressCallback,
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
                finished_runs.append(finished_run(jobs[update.number], update.end))
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
