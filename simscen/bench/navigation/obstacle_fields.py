"""Generator of obstacle fields like those of the BARN challenge, and experiments with drives through these fields."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt
from scipy import ndimage, spatial

from simscen.bench.navigation.barn import GOAL, START, scenario_text
from simscen.bench.navigation.experiments import Drive, Experiment, write_text
from simscen.core.geometry import Array, Pose3
from simscen.core.geometry.shapes import Cylinder, Solid
from simscen.core.random_streams import Streams
from simscen.worlds.geometry.triangulation import merge_solids
from simscen.worlds.routes.shortest_paths import ShortestPaths

CELL_SIZE_M = 0.15
"""Side of a grid cell. A filled cell contains a cylinder with this diameter."""
COLUMNS, FIELD_ROWS, ROWS = 30, 30, 64
"""Numbers of grid cells. The robot drives along y through a lane of ROWS rows and COLUMNS columns.

The last FIELD_ROWS rows of the lane are the obstacle field. The first and the last column are walls of cylinders.
"""
HEIGHT_M = 1.0
"""Height of all cylinders."""
FILL_RANGE = (0.20, 0.35)
"""Range of the fraction of cells that are filled before smoothing."""
FILL_NEIGHBORS, CLEAR_NEIGHBORS = 5, 1
"""Smoothing fills a cell with at least 5 filled neighbors (of 8), and clears a cell with at most 1 filled neighbor."""
CROSSING_RADIUS_M = 0.37
"""Radius of a disc that can cross every world of BARN, and every field that is generated with this default."""
MAX_ATTEMPTS = 1000
"""Maximum number of random draws for a field."""

Cells = npt.NDArray[np.bool_]
"""Array (rows, columns) that is true for filled cells."""


@dataclass(frozen=True, eq=False)
class ObstacleField:
    """Lane with cylinders at `centers` (n, 2). `shortest_path_m` is the length of the shortest path to GOAL."""

    number: int
    centers: Array
    shortest_path_m: float


def generate_obstacle_field(
    number: int, crossing_radius: float = CROSSING_RADIUS_M, blocked_radius: float | None = None
) -> ObstacleField:
    """Generate the field with this number (from 1). The result depends on the arguments only.

    A disc with `crossing_radius` in m can cross the field. A disc with `blocked_radius`, if given, cannot. Raises
    RuntimeError if no such field is found.
    """
    is_default = crossing_radius == CROSSING_RADIUS_M
    rng = Streams(number).generator("obstacle field" if is_default else f"obstacle field {crossing_radius:g}")
    for _ in range(MAX_ATTEMPTS):
        centers = _cylinder_centers(_smoothed_field(rng))
        if _is_crossable(centers, crossing_radius, blocked_radius):
            length = _shortest_path_length(centers, crossing_radius)
            if np.isfinite(length):
                return ObstacleField(number, centers, length)
    raise RuntimeError(f"none of {MAX_ATTEMPTS} fields with number {number} can be crossed")


def _smoothed_field(rng: np.random.Generator) -> Cells:
    """Return a field of random density with walls on both sides, smoothed two to four times as in BARN."""
    cells: Cells = rng.random((FIELD_ROWS, COLUMNS)) < rng.uniform(*FILL_RANGE)
    for _ in range(int(rng.integers(2, 5))):
        cells[:, [0, -1]] = True
        neighbors = ndimage.convolve(cells.astype(np.int64), np.ones((3, 3), np.int64), mode="constant") - cells
        cells = (cells | (neighbors >= FILL_NEIGHBORS)) & (neighbors > CLEAR_NEIGHBORS)
    cells[:, [0, -1]] = True
    return cells


def _cylinder_centers(field: Cells) -> Array:
    """Return the centers (n, 2) of all cylinders of the lane: the field, side walls, and a wall behind the start."""
    lane = np.zeros((ROWS, COLUMNS), np.bool_)
    lane[:, [0, -1]], lane[0] = True, True
    lane[ROWS - FIELD_ROWS :] = field
    rows, columns = np.nonzero(lane)
    return np.column_stack(((columns + 0.5 - COLUMNS) * CELL_SIZE_M, (rows + 0.5) * CELL_SIZE_M))


def _is_crossable(centers: Array, crossing_radius: float, blocked_radius: float | None) -> bool:
    """Return whether a disc of `crossing_radius` can move from START to GOAL, but a disc of `blocked_radius` cannot."""
    step = CELL_SIZE_M / 3
    x, y = np.meshgrid(np.arange(-COLUMNS * CELL_SIZE_M, 0.0, step), np.arange(0.0, GOAL.y + 1.0, step))
    distance, _ = spatial.cKDTree(centers).query(np.stack((x, y), axis=-1))

    def is_connected(radius: float) -> bool:
        pieces, _ = ndimage.label(distance > radius + CELL_SIZE_M / 2)
        start, goal = (
            pieces[round(pose.y / step), round((pose.x + COLUMNS * CELL_SIZE_M) / step)] for pose in (START, GOAL)
        )
        return bool(start and start == goal)

    return is_connected(crossing_radius) and not (blocked_radius is not None and is_connected(blocked_radius))


def _shortest_path_length(centers: Array, radius: float) -> float:
    """Return the length in m of the shortest path of a disc from START to GOAL; inf without a path."""
    pillar = Cylinder(CELL_SIZE_M / 2, HEIGHT_M)
    mesh = merge_solids(tuple(Solid(pillar, Pose3(x, y, HEIGHT_M / 2), "") for x, y in centers.tolist()))
    # The bounds are as wide as the lane, because a path could lead around the walls, which end with the field.
    bounds = (-COLUMNS * CELL_SIZE_M, 0.0, 0.0, GOAL.y + 1.0)
    return ShortestPaths(mesh, bounds, radius).length(START, GOAL)


NARROW_MARGINS_M = (0.30, 0.20, 0.10)
"""Guaranteed width of a passage through a narrow field, minus ROBOT_WIDTH_M.

The true width can be about 0.14 m larger, because `_is_crossable` tests `blocked_radius` on a grid.
"""
ROBOT_WIDTH_M = 0.42
"""Width of the Jackal across its wheels."""


def write_generated_fields(folder: Path, numbers: Iterable[int]) -> Experiment:
    """Write a drive through the generated field of each number. The seed of a run is the number of its field."""
    drives = [_field_drive(folder / "fields", generate_obstacle_field(number)) for number in numbers]
    return Experiment("generated fields", tuple(drives), folder, is_mapless=True)


def write_narrow_fields(folder: Path, numbers: Sequence[int]) -> list[Experiment]:
    """Write one experiment with narrow generated fields for each of NARROW_MARGINS_M."""
    experiments = []
    for margin in NARROW_MARGINS_M:
        crossing_radius, blocked_radius = (ROBOT_WIDTH_M + margin) / 2, (ROBOT_WIDTH_M + margin + 0.1) / 2
        target = folder / f"narrow/{round(100 * margin)}_cm"
        drives = [
            _field_drive(target, generate_obstacle_field(number, crossing_radius, blocked_radius)) for number in numbers
        ]
        experiments.append(Experiment(narrow_fields_name(margin), tuple(drives), folder, is_mapless=True))
    return experiments


def narrow_fields_name(margin: float) -> str:
    """Return the name of the experiment for one of NARROW_MARGINS_M."""
    return f"narrow fields, robot + {100 * margin:.0f} cm"


def _field_drive(folder: Path, field: ObstacleField) -> Drive:
    """Write the world and the scenario of a drive through a field to `folder`."""
    world = write_text(folder / f"field_{field.number}.world.yaml", _world_text(field))
    text = scenario_text(f"field {field.number}", world.name)
    file = write_text(folder / f"field_{field.number}.scenario.yaml", text)
    return Drive(file, [field.number], field.shortest_path_m)


def _world_text(field: ObstacleField) -> str:
    pillars = "\n".join(
        f"  - {{name: pillar, cylinder: [{CELL_SIZE_M / 2:g}, {HEIGHT_M:g}], pose: {{x: {x:.3f}, y: {y:.3f}}}}}"
        for x, y in field.centers.tolist()
    )
    return f"simscen: 1\nname: field {field.number}\nobstacles:\n{pillars}\n"
