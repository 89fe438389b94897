"""Speed of a whole run and its parts, compared with PyBullet alone in the same world."""

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
from simscen.record.recorder import MomentSink
from simscen.run.lockstep import RunSetup
from simscen.run.preparation import PreparedScenario, lidar_height, prepare
from simscen.run.simulate import GC_THRESHOLD, simulate
from simscen.sim.bullet.baseline import PyBulletBaseline
from simscen.stack.plugins.checked_stack import CheckedStack
from simscen.stack.reference import ReferenceStack
from simscen.worlds.geometry.triangulation import merge_solids, triangulate
from simscen.worlds.raycasting.ray_scene import RayScene

PATROL = Path(__file__).parents[2] / "data" / "bench" / "patrol.scenario.yaml"
SEED = 1
ProgressCallback = Callable[[str], None]
"""Receives the name of the present measurement."""
BEAMS = 720


@dataclass(frozen=True)
class Patrol:
    """CPU times in s of a run with `simulated` seconds.

    cpu, cpus:      whole run, median and all rounds
    parts, parted:  by part, median and all rounds
    bare, bares:    PyBullet alone with the same steps and scans, median and all rounds; measured after each run
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
        """Ratio of each run to PyBullet alone."""
        return tuple(cpu / bare for cpu, bare in zip(self.cpus, self.bares, strict=True))

    @property
    def ratio(self) -> float:
        """Median of the ratios. A slow phase of the machine affects both times of a ratio."""
        return statistics.median(self.ratios)

    @property
    def factor(self) -> float:
        """Simulated seconds per CPU second."""
        return self.simulated / self.cpu


@dataclass(frozen=True)
class Field:
    """Time of a scan with 720 beams and of a step among obstacles, in simscen and in PyBullet with one body each."""

    obstacles: int
    scan_ms: float
    step_us: float
    bare_scan_ms: float
    bare_step_us: float


def no_progress(_: str) -> None:
    """Ignore the progress."""


def measure_patrol(rounds: int, tell: ProgressCallback = no_progress) -> Patrol:
    """Measure several runs of the patrol with a log, then the parts of half as many more runs."""
    prepared = prepare(load_scenario(PATROL, PATROL.parent))
    simulated, *_ = timed_run(prepared)  # the first run pays for imports and caches
    cpus, bares = list[float](), list[float]()
    for number in range(rounds):
        tell(f"patrol, round {number + 1} of {rounds}")
        cpus.append(timed_run(prepared)[1])
        bares.append(bare_patrol(prepared, simulated))
    cpu = statistics.median(cpus)
    tell("parts of the patrol")
    measured = [_measure_parts(prepared, cpu) for _ in range((rounds + 1) // 2)]
    parted = {name: tuple(one[name] for one in measured) for name in measured[0]}
    parts = {name: statistics.median(each) for name, each in parted.items()}
    return Patrol(simulated, cpu, parts, statistics.median(bares), tuple(cpus), tuple(bares), parted)


def _measure_parts(prepared: PreparedScenario, cpu: float) -> dict[str, float]:
    """Return the CPU time in s of each part. The wall times of the stopwatch are scaled to a run without stopwatch."""
    watch = Stopwatch()
    _, _, whole = timed_run(prepared, watch)
    parts = {name: seconds * cpu / whole for name, seconds in watch.seconds.items()}
    parts["lockstep, set-up, verdicts"] = cpu - sum(parts.values())
    return parts


def timed_run(prepared: PreparedScenario, watch: Stopwatch | None = None) -> tuple[float, float, float]:
    """Return simulated, CPU, and wall seconds of a run from setup to verdicts. `watch` measures its parts."""
    gc.collect()
    gc.freeze()  # as the warm process does, so that older objects are not searched for garbage
    before = gc.get_threshold()
    gc.set_threshold(GC_THRESHOLD)  # as a run's own process does
    with TemporaryDirectory() as folder:
        begun, begun_wall = time.process_time(), time.perf_counter()
        run = simulate(prepared, SEED, log=Path(folder, "run.mcap"), attach=partial(_watched, watch) if watch else None)
        cpu, wall = time.process_time() - begun, time.perf_counter() - begun_wall
    gc.set_threshold(*before)
    gc.unfreeze()
    return run.result.simulated, cpu, wall


def _watched(watch: Stopwatch, setup: RunSetup, own: Sequence[MomentSink]) -> Sequence[MomentSink]:
    """Measure the parts of a run, and its `own` listeners: trace and log."""
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
    for name, listener, methods in zip(("trace", "log"), own, (("append",), ("append", "flush_if_due")), strict=True):
        watch.watch(name, listener, *methods)
    return ()


def bare_patrol(prepared: PreparedScenario, simulated: float) -> float:
    """Return the CPU seconds that PyBullet alone takes for as many steps and scans in the same world."""
    lidar = next(sensor.lidar for sensor in prepared.robot.sensors.values() if sensor.lidar)
    bare = PyBulletBaseline(prepared.built.mesh, prepared.body, prepared.start, triangulate)
    around = _circle(lidar.beams)
    begun = time.process_time()
    for _ in range(round(simulated * lidar.rate)):
        bare.step(round(240 / lidar.rate))
        bare.scan(around, lidar.min_range, lidar.max_range, lidar_height(prepared.robot))
    cpu = time.process_time() - begun
    bare.close()
    return cpu


def measure_field(obstacles: int) -> Field:
    """Measure scans and steps among cylinders, as dense as in a BARN world (0.9 per square meter)."""
    prepared = prepare(load_scenario(PATROL, PATROL.parent))
    solids = cylinders(obstacles)
    mesh, start, height = merge_solids(solids), Pose2(0.0, 0.0, 0.0), lidar_height(prepared.robot)
    rays = RayScene(mesh)
    around = _circle(BEAMS)
    directions = np.column_stack((around, np.zeros(BEAMS)))
    origins = np.tile([0.0, 0.0, height], (BEAMS, 1))
    fused = PyBulletBaseline(mesh, prepared.body, start, triangulate)
    bare = PyBulletBaseline(solids, prepared.body, start, triangulate)
    field = Field(
        obstacles,
        scan_ms=1e3 * _each(lambda: rays.cast(origins, directions), 200),
        step_us=1e6 * _each(lambda: fused.step(1), 2000),
        bare_scan_ms=1e3 * _each(lambda: bare.scan(around, 0.12, 30.0, height), 10),
        bare_step_us=1e6 * _each(lambda: bare.step(1), 500),
    )
    fused.close()
    bare.close()
    return field


def _circle(beams: int) -> Array:
    """Return evenly spaced directions (beams, 2)."""
    angles = np.linspace(-np.pi, np.pi, beams, endpoint=False)
    return np.column_stack((np.cos(angles), np.sin(angles)))


def cylinders(count: int) -> list[Solid]:
    """Return `count` random cylinders with a radius of 7.5 cm, none within 1 m of the origin."""
    rng = np.random.default_rng(SEED)
    edge = (count / 0.9) ** 0.5 / 2
    places = rng.uniform(-edge, edge, (4 * count + 40, 2))
    places = places[np.hypot(*places.T) > 1.0][:count]
    return [Solid(Cylinder(0.075, 1.0), Pose3(x, y, 0.5), f"cylinder {k}") for k, (x, y) in enumerate(places.tolist())]


def _each(what: Callable[[], Any], times: int) -> float:
    """Return the CPU seconds of one call, as median of five rounds."""
    rounds = []
    for _ in range(5):
        begun = time.process_time()
        for _ in range(times):
            what()
        rounds.append((time.process_time() - begun) / times)
    return statistics.median(rounds)
