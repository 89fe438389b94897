"""Measurement of the CPU time per simulated second of drives in large worlds."""

import gc
import math
import resource
import statistics
import sys
import time
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise, product
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from simscen.bench.speed.run_speed import PATROL, time_run
from simscen.core.environment.occupancy_grid import FREE, OCCUPIED, OccupancyGrid
from simscen.core.geometry import Pose2, Pose3
from simscen.core.geometry.shapes import Box, Solid
from simscen.loading.scenario import load_scenario
from simscen.run.preparation import prepare
from simscen.worlds.geometry.triangulation import merge_solids
from simscen.worlds.maps.ros_map import save_map

HOUSE = PATROL.with_name("house.scenario.yaml")
"""Scenario of a patrol of the rooms of a house."""
MOVABLE_COUNT = 40
"""Number of movable meshes in the hall."""
STATIC_COUNT, MOVING_COUNT = 4980, 20
"""Numbers of static objects and moving carts in the warehouse."""
MAP_SIDE_CELLS = 2000
"""Number of cells of 5 cm along each side of the arena's map: 100 x 100 m."""
SCENARIO_TEMPLATE = """\
simscen: 1
seed: 1
world: {world}
robot: {{pose: {{x: {start[0]}, y: {start[1]}}}}}
goals: [{goals}]
time_limit: 60 s
pass:
  - collisions: {{max: 0}}
"""


@dataclass(frozen=True)
class WorldCost:
    """CPU time and memory of runs in a world. The names of the fields are keys of the JSON output.

    name:         description of the world
    triangles:    number of triangles of static solids
    movable:      number of movable bodies
    simulated:    simulated time of a run in s
    milliseconds: CPU time per simulated second in ms
    preparing:    CPU time in s to load and prepare the scenario, once for all runs
    memory:       maximum memory of this process since its start, in MB
    """

    name: str
    triangles: int
    movable: int
    simulated: float
    milliseconds: float
    preparing: float
    memory: float


def measure_worlds(rounds: int) -> Iterator[WorldCost]:
    """Measure `rounds` runs in each world: a house, a hall, a warehouse, and an arena with a large map."""
    with TemporaryDirectory() as folder:
        yield _measure_world("house, patrol of five rooms", HOUSE, rounds)
        yield _measure_world(f"hall, {MOVABLE_COUNT} movable meshes", write_hall(Path(folder, "hall")), rounds)
        objects = f"{STATIC_COUNT + MOVING_COUNT} objects, {MOVING_COUNT} moving"
        yield _measure_world(f"warehouse, {objects}", write_warehouse(Path(folder, "warehouse")), rounds)
        yield _measure_world("map of 100 x 100 m", write_arena(Path(folder, "arena")), rounds)


def _measure_world(name: str, file: Path, rounds: int) -> WorldCost:
    """Measure `rounds` runs of a scenario file. `name` describes its world."""
    gc.collect()  # garbage of the previous world must not add to the maximum memory
    start = time.process_time()
    prepared = prepare(load_scenario(file, file.parent))
    preparing = time.process_time() - start
    time_run(prepared)  # the first run pays for imports and caches
    runs = [time_run(prepared) for _ in range(rounds)]
    simulated = runs[0].simulated
    return WorldCost(
        name,
        triangles=len(prepared.built.mesh.faces),
        movable=len(prepared.built.world.bodies),
        simulated=simulated,
        milliseconds=1e3 * statistics.median(run.cpu for run in runs) / simulated,
        preparing=preparing,
        memory=_peak_memory_mb(),
    )


def _peak_memory_mb() -> float:
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return peak / 1e6 if sys.platform == "darwin" else peak / 1e3


def write_hall(folder: Path) -> Path:
    """Write an SDF world of 30 x 20 m with MOVABLE_COUNT chairs (meshes of 432 triangles); return its scenario file."""
    folder.mkdir()
    for number in range(4):
        (folder / f"mesh_{number}.obj").write_text(_obj_text(_chair(0.4 + 0.05 * number)))
    positions = [(2.5 + 3.5 * column, 2.0 + 4.0 * row) for row, column in product(range(5), range(8))]
    models = "".join(_mesh_model(number, x, y) for number, (x, y) in enumerate(positions))
    walls = "".join(
        _box_model(name, x, y, length, width)
        for name, x, y, length, width in (
            ("south", 15, 0, 30, 0.2),
            ("north", 15, 20, 30, 0.2),
            ("west", 0, 10, 0.2, 20),
            ("east", 30, 10, 0.2, 20),
        )
    )
    (folder / "hall.world").write_text(f'<sdf version="1.7"><world name="hall">{walls}{models}</world></sdf>')
    return _write_scenario(folder, "hall.world", ((1.0, 4.0), (25.0, 4.0), (25.0, 12.0), (1.0, 12.0)))


def _chair(width: float) -> list[Solid]:
    """Return the boxes of a chair with this seat width in m: slats of seat and back, and four legs."""
    half, slats = width / 2 - 0.02, np.linspace(-1, 1, 16).tolist()
    parts = [((width, width / 20, 0.04), (0.0, half * offset, 0.46)) for offset in slats]
    parts += [((0.04, width / 20, 0.5), (-half, half * offset, 0.73)) for offset in slats]
    parts += [((0.04, 0.04, 0.44), (x, y, 0.22)) for x in (-half, half) for y in (-half, half)]
    return [Solid(Box(size), Pose3(*position), "chair") for size, position in parts]


def _obj_text(solids: list[Solid]) -> str:
    """Return one mesh of all solids as a Wavefront OBJ file."""
    mesh = merge_solids(solids)
    corners = [f"v {x} {y} {z}" for x, y, z in mesh.vertices.tolist()]
    return "\n".join([*corners, *(f"f {a + 1} {b + 1} {c + 1}" for a, b, c in mesh.faces.tolist())]) + "\n"


def _mesh_model(number: int, x: float, y: float) -> str:
    mesh = f"<mesh><uri>mesh_{number % 4}.obj</uri></mesh>"
    return (
        f'<model name="chair {number}"><pose>{x} {y} 0 0 0 {number}</pose><link name="body">'
        "<inertial><mass>5</mass></inertial>"
        f'<collision name="c"><geometry>{mesh}</geometry></collision></link></model>'
    )


def _box_model(name: str, x: float, y: float, length: float, width: float) -> str:
    """Return the SDF of a static box with a height of 1 m."""
    box = f"<box><size>{length} {width} 1</size></box>"
    return (
        f'<model name="{name}"><static>true</static><pose>{x} {y} 0.5 0 0 0</pose><link name="body">'
        f'<collision name="c"><geometry>{box}</geometry></collision></link></model>'
    )


def write_warehouse(folder: Path) -> Path:
    """Write a warehouse of 100 x 100 m with rows of boxes and drums, and moving carts; return its scenario file."""
    folder.mkdir()
    rng = np.random.default_rng(12)
    columns = [*np.arange(4.0, 46.0, 0.75).tolist(), *np.arange(54.5, 96.5, 0.75).tolist()]
    bays = list(product(columns, (row + side for row in range(4, 97, 4) for side in (-0.4, 0.4))))
    chosen = rng.permutation(len(bays))[:STATIC_COUNT].tolist()
    stock = [
        f"  - {{name: unit {n}, {_box_or_drum(n)},"
        f" pose: {{x: {bays[bay][0]:.2f}, y: {bays[bay][1]:.2f}, yaw: {turn:.2f}}}}}"
        for n, (bay, turn) in enumerate(zip(chosen, rng.uniform(-0.2, 0.2, STATIC_COUNT), strict=True))
    ]
    carts = [
        f"  - {{name: cart {n}, box: [0.9, 0.6, 0.9], pose: {{x: {x}, y: {y + 0.8:.1f}}},"
        f" move: {{through: [[{x + 20}, {y + 0.8:.1f}]], speed: 0.5 m/s, repeat: back_and_forth}}}}"
        for n, (x, y) in enumerate(product((12, 60), (26, 30, 34, 38, 42, 62, 66, 70, 74, 78)))
    ]
    walls = "  - {name: outer wall, points: [[0, 0], [100, 0], [100, 100], [0, 100], [0, 0]]}"
    lines = ["simscen: 1", "walls:", walls, "obstacles:", *stock, "objects:", *carts]
    (folder / "warehouse.world.yaml").write_text("\n".join(lines) + "\n")
    return _write_scenario(folder, "warehouse.world.yaml", ((8.0, 33.8), (48.0, 33.8), (50.0, 42.0)))


def _box_or_drum(number: int) -> str:
    """Return the YAML of a shape 0.5 to 0.65 m wide: a drum for every fourth number, otherwise a box."""
    width = 0.5 + 0.05 * (number % 4)
    return f"cylinder: [{width / 2:.3f}, 1.0]" if number % 4 == 0 else f"box: [{width:.2f}, {width:.2f}, 1.2]"


def write_arena(folder: Path) -> Path:
    """Write a ROS map of 100 x 100 m with 400 blocks and 0.5 % of single cells occupied; return its scenario file."""
    folder.mkdir()
    rng = np.random.default_rng(7)
    cells = np.full((MAP_SIDE_CELLS, MAP_SIDE_CELLS), FREE, dtype=np.int8)
    cells[rng.random((MAP_SIDE_CELLS, MAP_SIDE_CELLS)) < 0.005] = OCCUPIED
    cells[:4] = cells[-4:] = cells[:, :4] = cells[:, -4:] = OCCUPIED
    for column, row, width, depth in rng.integers(
        (10, 10, 8, 8), (MAP_SIDE_CELLS - 60, MAP_SIDE_CELLS - 60, 50, 50), (400, 4)
    ).tolist():
        cells[row : row + depth, column : column + width] = OCCUPIED
    middle = MAP_SIDE_CELLS // 2
    cells[middle - 12 : middle + 12, 60:-60] = FREE
    save_map(OccupancyGrid(cells, 0.05, Pose2(0.0, 0.0)), folder / "arena.yaml")
    return _write_scenario(folder, "arena.yaml", ((5.0, 50.0), (25.0, 50.0), (50.0, 50.0)))


def _write_scenario(folder: Path, world: str, waypoints: tuple[tuple[float, float], ...]) -> Path:
    """Write a scenario with its start at the first waypoint (x, y), and goals at all others; return the file."""
    goals = ", ".join(
        f"{{pose: {{x: {bx}, y: {by}, yaw: {math.atan2(by - ay, bx - ax):.4f}}}}}"
        for (ax, ay), (bx, by) in pairwise(waypoints)
    )
    file = folder / f"{folder.name}.scenario.yaml"
    file.write_text(SCENARIO_TEMPLATE.format(world=world, start=waypoints[0], goals=goals))
    return file
