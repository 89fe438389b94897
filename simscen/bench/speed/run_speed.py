"""Measure the CPU time of a run and of its parts, compared with a baseline: PyBullet alone in the same world."""

import gc
import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from simscen.bench.speed.measurement import Stopwatch
from simscen.core.geometry import Array, Pose2, Pose3
from simscen.core.geometry.shapes import Cylinder, Solid
from simscen.loading.scenario import load_scenario
from simscen.record.moment_buffer import MomentSink
from simscen.run.lockstep import RunSetup
from simscen.run.preparation import PreparedScenario, lidar_height, prepare
from simscen.run.simulate import GC_THRESHOLD, simulate
from simscen.sim.bullet.baseline import PyBulletBaseline
from simscen.stack.checked_stack import CheckedStack
from simscen.stack.reference import ReferenceStack
from simscen.worlds.geometry.triangulation import merge_solids, triangulate
from simscen.worlds.raycasting.ray_scene import RayScene

PATROL = Path(__file__).parents[2] / "data" / "bench" / "patrol.scenario.yaml"
"""Scenario of most speed benchmarks: a robot drives among racks and a moving cart in a hall."""
SEED = 1
ProgressCallback = Callable[[str], None]
"""Receives the name of the current measurement."""
BEAMS = 720
"""Number of beams of a scan in measure_obstacle_field."""


@dataclass(frozen=True)
class PatrolTimes:
    """CPU times in s of a run of PATROL. The names of the fields are keys of the JSON output.

    simulated:      simulated time of a run in s
    cpu, cpus:      whole run: median, and each round
    parts, parted:  each part of the run by name: median, and each round
    bare, bares:    PyBullet baseline with the same steps and scans: median, and each round, measured after the run
    """

    simulated: float
    cpu: float
    parts: dict[str, float]
    bare: float
    cpus: tuple[float, ...]
    bares: tuple[float, ...]
    parted: dict[str, tuple[float, ...]]

    @property
    def ratios(self) -> tuple[float, ...]:
        """CPU time of each run divided by that of the PyBullet baseline."""
        return tuple(cpu / bare for cpu, bare in zip(self.cpus, self.bares, strict=True))

    @property
    def ratio(self) -> float:
        """Median of `ratios`. It varies less than CPU times, because a slow machine affects both times of a ratio."""
        return statistics.median(self.ratios)

    @property
    def factor(self) -> float:
        """Simulated seconds per CPU second."""
        return self.simulated / self.cpu


@dataclass(frozen=True)
class ObstacleFieldTimes:
    """CPU times of a scan with BEAMS beams in ms, and of a physics step in µs, among `obstacles` cylinders.

    simscen merges the cylinders into one mesh. The `bare_` times are those of PyBullet with a body for each cylinder.
    """

    obstacles: int
    scan_ms: float
    step_us: float
    bare_scan_ms: float
    bare_step_us: float


def no_progress(_: str) -> None:
    """Ignore the progress (a ProgressCallback)."""


def measure_patrol(rounds: int, report_progress: ProgressCallback = no_progress) -> PatrolTimes:
    """Measure `rounds` runs of PATROL with a log, then the parts of half as many more runs."""
    prepared = prepare(load_scenario(PATROL, PATROL.parent))
    simulated, *_ = time_run(prepared)  # the first run pays for imports and caches
    cpus, bares = list[float](), list[float]()
    for number in range(rounds):
        report_progress(f"patrol, round {number + 1} of {rounds}")
        cpus.append(time_run(prepared)[1])
        bares.append(time_baseline_patrol(prepared, simulated))
    cpu = statistics.median(cpus)
    report_progress("parts of the patrol")
    part_rounds = [_measure_parts(prepared, cpu) for _ in range((rounds + 1) // 2)]
    parted = {name: tuple(parts[name] for parts in part_rounds) for name in part_rounds[0]}
    parts = {name: statistics.median(times) for name, times in parted.items()}
    return PatrolTimes(simulated, cpu, parts, statistics.median(bares), tuple(cpus), tuple(bares), parted)


def _measure_parts(prepared: PreparedScenario, cpu: float) -> dict[str, float]:
    """Return the CPU time in s of each part: its wall time, scaled to the CPU time `cpu` of a run without stopwatch."""
    watch = Stopwatch()
    _, _, whole = time_run(prepared, watch)
    parts = {name: seconds * cpu / whole for name, seconds in watch.seconds.items()}
    parts["lockstep, set-up, verdicts"] = cpu - sum(parts.values())
    return parts


def time_run(prepared: PreparedScenario, watch: Stopwatch | None = None) -> tuple[float, float, float]:
    """Return simulated, CPU, and wall time in s of a run from setup to verdicts. `watch` measures its parts."""
    gc.collect()
    gc.freeze()  # as the fork server does, so that older objects are not searched for garbage
    previous = gc.get_threshold()
    gc.set_threshold(GC_THRESHOLD)  # as a run's own process does
    with TemporaryDirectory() as folder:
        cpu_start, wall_start = time.process_time(), time.perf_counter()
        attach = partial(_watch_parts, watch) if watch else None
        run = simulate(prepared, SEED, log=Path(folder, "run.mcap"), attach=attach)
        cpu, wall = time.process_time() - cpu_start, time.perf_counter() - wall_start
    gc.set_threshold(*previous)
    gc.unfreeze()
    return run.result.simulated, cpu, wall


def _watch_parts(watch: Stopwatch, setup: RunSetup, listeners: Sequence[MomentSink]) -> Sequence[MomentSink]:
    """Let `watch` measure the parts of a run, including its `listeners`: trace and log. Return no further listeners."""
    (agent,) = setup.robots
    watch.watch("physics", setup.simulation, "step")
    watch.watch("physics", agent.robot, "drive")
    watch.watch("truth and contacts", agent.robot, "truth", "sample", "collisions")
    watch.watch("truth and contacts", agent.robot.sampler, "compute_deferred")
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
    """Return the CPU time in s of PyBullet alone for the steps and scans of `simulated` seconds in the same world."""
    lidar = next(sensor.lidar for sensor in prepared.robot.sensors.values() if sensor.lidar)
    baseline = PyBulletBaseline(prepared.built.mesh, prepared.body, prepared.start, triangulate)
    directions = _circle(lidar.beams)
    start = time.process_time()
    for _ in range(round(simulated * lidar.rate)):
        baseline.step(round(240 / lidar.rate))
        baseline.scan(directions, lidar.min_range, lidar.max_range, lidar_height(prepared.robot))
    cpu = time.process_time() - start
    baseline.close()
    return cpu


def measure_obstacle_field(obstacles: int) -> ObstacleFieldTimes:
    """Measure scans and physics steps among cylinders that are as dense as in a BARN world (0.9 per square meter)."""
    prepared = prepare(load_scenario(PATROL, PATROL.parent))
    solids = random_cylinders(obstacles)
    mesh, start, height = merge_solids(solids), Pose2(0.0, 0.0, 0.0), lidar_height(prepared.robot)
    rays = RayScene(mesh)
    planar = _circle(BEAMS)
    directions = np.column_stack((planar, np.zeros(BEAMS)))
    origins = np.tile([0.0, 0.0, height], (BEAMS, 1))
    merged = PyBulletBaseline(mesh, prepared.body, start, triangulate)
    separate = PyBulletBaseline(solids, prepared.body, start, triangulate)
    field = ObstacleFieldTimes(
        obstacles,
        scan_ms=1e3 * _cpu_per_call(lambda: rays.cast(origins, directions), 200),
        step_us=1e6 * _cpu_per_call(lambda: merged.step(1), 2000),
        bare_scan_ms=1e3 * _cpu_per_call(lambda: separate.scan(planar, 0.12, 30.0, height), 10),
        bare_step_us=1e6 * _cpu_per_call(lambda: separate.step(1), 500),
    )
    merged.close()
    separate.close()
    return field


def _circle(beams: int) -> Array:
    """Return evenly spaced unit vectors (beams, 2)."""
    angles = np.linspace(-np.pi, np.pi, beams, endpoint=False)
    return np.column_stack((np.cos(angles), np.sin(angles)))


def random_cylinders(count: int) -> list[Solid]:
    """Return `count` cylinders at random positions, with a radius of 7.5 cm, none within 1 m of the origin."""
    rng = np.random.default_rng(SEED)
    edge = (count / 0.9) ** 0.5 / 2
    positions = rng.uniform(-edge, edge, (4 * count + 40, 2))
    positions = positions[np.hypot(*positions.T) > 1.0][:count]
    return [
        Solid(Cylinder(0.075, 1.0), Pose3(x, y, 0.5), f"cylinder {k}") for k, (x, y) in enumerate(positions.tolist())
    ]


def _cpu_per_call(call: Callable[[], Any], times: int) -> float:
    """Return the CPU seconds of one call, as median of five rounds."""
    rounds = []
    for _ in range(5):
        start = time.process_time()
        for _ in range(times):
            call()
        rounds.append((time.process_time() - start) / times)
    return statistics.median(rounds)
