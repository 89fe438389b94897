"""How fast a suite of scenarios is run on all cores, beside PyBullet stepping and scanning as long."""

import statistics
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from simscen.bench.speed.measurement import Measurement, Measurements
from simscen.bench.speed.run_speed import PATROL, Tell, bare_patrol, nobody
from simscen.core.records.session_events import RunFinished
from simscen.loading.loaded import LoadedScenario
from simscen.loading.plugins import plugins_of_all
from simscen.loading.scenario import load_scenario
from simscen.run.preparation.scenario import prepare
from simscen.run.process.isolation import plugin_path_arguments
from simscen.run.process.jobs import ProcessEnd
from simscen.run.process.supervisor import Ended, supervise
from simscen.run.sessions.results import finished_run
from simscen.run.sessions.run_session import SessionOptions, plan_jobs

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


def spread_over(scenarios: Sequence[LoadedScenario], most: int) -> list[LoadedScenario]:
    """At most so many, evenly taken from all."""
    if len(scenarios) <= most:
        return list(scenarios)
    return [scenarios[number * len(scenarios) // most] for number in range(most)]


def measure_suite(
    scenarios: Sequence[LoadedScenario], workers: int, out: Path, entry: Sequence[str], tell: Tell = nobody
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
