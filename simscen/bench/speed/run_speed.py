"""Measurement of the CPU time of a run and its parts, and of a baseline: PyBullet alone in the same world."""

import gc
import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

import numpy as np

from simscen.bench.speed.measurement import Stopwatch
from simscen.core.geometry import Array, Pose2, Pose3
from simscen.core.geometry.shapes import Cylinder, Solid
from simscen.loading.scenario import load_scenario
from simscen.record.moment_buffer import MomentSink
from simscen.run.lockstep import RunSetup
from simscen.run.preparation import PreparedScenario, lidar_height, prepare
from simscen.run.run_files import GC_THRESHOLD
from simscen.run.simulate import simulate
from simscen.sim.bullet.baseline import PyBulletBaseline
from simscen.stack.reference import ReferenceStack
from simscen.stack.validation.stack import CheckedStack
from simscen.worlds.geometry.triangulation import merge_solids, triangulate
from simscen.worlds.raycasting.ray_scene import RayScene

PATROL = Path(__file__).parents[2] / "data" / "bench" / "patrol.scenario.yaml"
"""Scenario of most speed benchmarks: a robot drives among racks and a moving cart in a hall."""
SEED = 1
"""Seed of all measured runs."""
ProgressCallback = Callable[[str], None]
"""Function that is called at the start of each measurement, with its name."""
OBSTACLE_FIELD_BEAMS = 720
"""Number of beams of a scan in `measure_obstacle_field`."""


class RunTimes(NamedTuple):
    """Simulated time, CPU time, and wall time of a run in s."""

    simulated: float
    cpu: float
    wall: float


@dataclass(frozen=True)
class PatrolTimes:
    """CPU times in s of runs of PATROL. The names of the fields are keys of the JSON output.

    simulated: simulated time of a run in s
    cpu:       CPU time of a run
    parts:     CPU time of each part of a run by name
    baseline:  CPU time of the PyBullet baseline with the same steps and scans

    `cpu`, `parts`, and `baseline` are medians. The fields `…_rounds` have the value of each round.
    """

    simulated: float
    cpu: float
    parts: dict[str, float]
    baseline: float
    cpu_rounds: tuple[float, ...]
    baseline_rounds: tuple[float, ...]
    part_rounds: dict[str, tuple[float, ...]]

    @property
    def ratios(self) -> tuple[float, ...]:
        """CPU time of the run divided by the CPU time of the PyBullet baseline, for each round."""
        return tuple(cpu / baseline for cpu, baseline in zip(self.cpu_rounds, self.baseline_rounds, strict=True))

    @property
    def ratio(self) -> float:
        """Median of `ratios`."""
        return statistics.median(self.ratios)

    @property
    def real_time_factor(self) -> float:
        """Simulated seconds per CPU second."""
        return self.simulated / self.cpu


@dataclass(frozen=True)
class ObstacleFieldTimes:
    """CPU times of a scan in ms and of a physics step in µs among `obstacles` cylinders.

    `scan_ms` and `step_us` are measured with one mesh of all cylinders, as in simscen. `baseline_scan_ms` and
    `baseline_step_us` are measured in PyBullet with a body for each cylinder.
    """

    obstacles: int
    scan_ms: float
    step_us: float
    baseline_scan_ms: float
    baseline_step_us: float


def measure_patrol(rounds: int, report_progress: ProgressCallback = lambda _: None) -> PatrolTimes:
    """Measure `rounds` runs of PATROL and of its baseline, and then the parts of further runs."""
    prepared = prepare(load_scenario(PATROL, PATROL.parent))
    simulated = time_run(prepared).simulated  # the first run pays for imports and caches
    cpu_rounds, baseline_rounds = list[float](), list[float]()
    for number in range(rounds):
        report_progress(f"patrol, round {number + 1} of {rounds}")
        cpu_rounds.append(time_run(prepared).cpu)
        baseline_rounds.append(time_baseline_patrol(prepared, simulated))
    cpu = statistics.median(cpu_rounds)
    report_progress("parts of the patrol")
    measured = [_measure_parts(prepared, cpu) for _ in range((rounds + 1) // 2)]
    part_rounds = {name: tuple(parts[name] for parts in measured) for name in measured[0]}
    return PatrolTimes(
        simulated, cpu, parts={name: statistics.median(times) for name, times in part_rounds.items()},
        baseline=statistics.median(baseline_rounds), cpu_rounds=tuple(cpu_rounds),
        baseline_rounds=tuple(baseline_rounds), part_rounds=part_rounds,
    )  # fmt: skip


def _measure_parts(prepared: PreparedScenario, cpu: float) -> dict[str, float]:
    """Return the CPU time in s of each part of a run by name. Their sum is `cpu`, the CPU time of a run in s.

    The parts are measured as wall time, and scaled to CPU time.
    """
    watch = Stopwatch()
    whole = time_run(prepared, watch).wall
    parts = {name: seconds * cpu / whole for name, seconds in watch.seconds.items()}
    parts["lockstep, setup, verdicts"] = cpu - sum(parts.values())
    return parts


def time_run(prepared: PreparedScenario, watch: Stopwatch | None = None) -> RunTimes:
    """Run a scenario, and return the times from setup to verdicts. `watch`, if given, measures the parts of the run."""
    gc.collect()
    gc.freeze()  # as the fork server does, so that older objects are not searched for garbage
    previous = gc.get_threshold()
    gc.set_threshold(GC_THRESHOLD)  # as a run's own process does
    try:
        with TemporaryDirectory() as folder:
            cpu_start, wall_start = time.process_time(), time.perf_counter()
            attach = partial(_watch_parts, watch) if watch else None
            run = simulate(prepared, SEED, log=Path(folder, "run.mcap"), attach=attach)
            cpu, wall = time.process_time() - cpu_start, time.perf_counter() - wall_start
    finally:
        gc.set_threshold(*previous)
        gc.unfreeze()
    return RunTimes(run.result.simulated, cpu, wall)


def _watch_parts(watch: Stopwatch, setup: RunSetup, listeners: Sequence[MomentSink]) -> Sequence[MomentSink]:
    """Let `watch` measure the parts of a run. Return no further listeners.

    `listeners` are the existing listeners of the run: trace (the recorded states) and log.
    """
    (agent,) = setup.robots
    watch.watch("physics", setup.simulation, "step")
    watch.watch("physics", agent.robot, "drive")
    watch.watch("truth and contacts", agent.robot, "truth", "sample", "collisions", "compute_deferred")
    watch.watch("sensors", agent.sensors, "read")
    if isinstance(agent.stack, CheckedStack) and isinstance(agent.stack.inner, ReferenceStack):
        for name, component, methods in agent.stack.inner.components:
            watch.watch(name, component, *methods)
    watch.watch("navigator", agent.stack, "decide")
    methods_of = {"trace": ("append",), "log": ("append", "flush_if_due")}
    for (name, methods), listener in zip(methods_of.items(), listeners, strict=True):
        watch.watch(name, listener, *methods)
    return ()


def time_baseline_patrol(prepared: PreparedScenario, simulated: float) -> float:
    """Return the CPU time in s of the PyBullet baseline for the steps and scans of `simulated` seconds."""
    lidar = next(sensor.lidar for sensor in prepared.robot.sensors.values() if sensor.lidar)
    baseline = PyBulletBaseline(prepared.built.mesh, prepared.body, prepared.start, triangulate)
    directions = _unit_vectors(lidar.beams)
    start = time.process_time()
    for _ in range(round(simulated * lidar.rate)):
        baseline.step(round(240 / lidar.rate))
        baseline.scan(directions, lidar.min_range, lidar.max_range, lidar_height(prepared.robot))
    cpu = time.process_time() - start
    baseline.close()
    return cpu


def measure_obstacle_field(obstacles: int) -> ObstacleFieldTimes:
    """Measure scans and physics steps among this number of cylinders.

    There are about 0.9 cylinders per square meter, but none within 1 m of the robot.
    """
    prepared = prepare(load_scenario(PATROL, PATROL.parent))
    solids = random_cylinders(obstacles)
    mesh, start, height = merge_solids(solids), Pose2(0.0, 0.0, 0.0), lidar_height(prepared.robot)
    rays = RayScene(mesh)
    planar = _unit_vectors(OBSTACLE_FIELD_BEAMS)
    directions = np.column_stack((planar, np.zeros(OBSTACLE_FIELD_BEAMS)))
    origins = np.tile([0.0, 0.0, height], (OBSTACLE_FIELD_BEAMS, 1))
    merged = PyBulletBaseline(mesh, prepared.body, start, triangulate)
    separate = PyBulletBaseline(solids, prepared.body, start, triangulate)
    field = ObstacleFieldTimes(
        obstacles,
        scan_ms=1e3 * _cpu_per_call(lambda: rays.cast(origins, directions), 200),
        step_us=1e6 * _cpu_per_call(lambda: merged.step(1), 2000),
        baseline_scan_ms=1e3 * _cpu_per_call(lambda: separate.scan(planar, 0.12, 30.0, height), 10),
        baseline_step_us=1e6 * _cpu_per_call(lambda: separate.step(1), 500),
    )
    merged.close()
    separate.close()
    return field


def _unit_vectors(beams: int) -> Array:
    """Return unit vectors (beams, 2) with evenly spaced directions."""
    angles = np.linspace(-np.pi, np.pi, beams, endpoint=False)
    return np.column_stack((np.cos(angles), np.sin(angles)))


def random_cylinders(count: int) -> list[Solid]:
    """Return `count` cylinders with a radius of 7.5 cm at random positions at least 1 m from the origin."""
    rng = np.random.default_rng(SEED)
    edge = (count / 0.9) ** 0.5 / 2
    positions = rng.uniform(-edge, edge, (4 * count + 40, 2))
    positions = positions[np.hypot(*positions.T) > 1.0][:count]
    return [
        Solid(Cylinder(0.075, 1.0), Pose3(x, y, 0.5), f"cylinder {k}") for k, (x, y) in enumerate(positions.tolist())
    ]


def _cpu_per_call(call: Callable[[], Any], times: int) -> float:
    """Return the CPU time in s of one call: the median of five rounds with `times` calls."""
    rounds = []
    for _ in range(5):
        start = time.process_time()
        for _ in range(times):
            call()
        rounds.append((time.process_time() - start) / times)
    return statistics.median(rounds)
