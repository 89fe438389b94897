"""Reader for the worlds of the BARN challenge, and generator of obstacle fields like those of BARN and DynaBARN.

In BARN (Perille et al., SSRR 2020), a Jackal drives 10 m through a field of cylinders without a map. In DynaBARN, the
cylinders move. Any contact ends the run.
"""

import csv
import math
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from simscen.core.errors import UsageError
from simscen.core.geometry import Array, Pose2, Pose3
from simscen.core.geometry.shapes import Cylinder, Solid
from simscen.core.random_streams import Streams

PUBLISHED_DWA_RESULTS = {"success": 0.850, "collisions": 0.056, "timeouts": 0.094, "score": 0.159}
"""Published results of the dynamic window approach (DWA) in BARN at 0.5 m/s, from 50 worlds with 10 runs each."""

START, GOAL = Pose2(-2.25, 3.0, 1.57), Pose2(-2.25, 13.0, 1.57)
"""Start and goal of the robot in BARN."""

ODOMETRY_LOCALIZER = "type: slip_ekf, rotation_noise: 0.5"
"""YAML keys of a localizer that takes distances from the wheels and rotations from the gyroscope."""
SCAN_MATCHING_LOCALIZER = f"{{{ODOMETRY_LOCALIZER}, match_scans: true}}"
"""YAML of the same localizer with laser scan matching."""
COSTMAP = "{obstacle_max_range: 8 m, raytrace_max_range: 10 m, update_frequency: 10 Hz}"
"""YAML of the costmap parameters for mapless drives."""
TUNED_STACK = f"""\
  localizer: {SCAN_MATCHING_LOCALIZER}
  costmap: {COSTMAP}
  # Nav2's 0.9 m is for 0.5 m/s; at 2 m/s, this radius gives a lateral acceleration of 2 m/s².
  controller:
    type: regulated_pure_pursuit  # explicit, so that another controller replaces it as a whole
    desired_linear_vel: 2 m/s
    regulated_linear_scaling_min_radius: 2 m
"""
"""YAML lines of `stack:` for 2 m/s, the speed of the challenge."""
TUNED_STACK_FOR_MOVING_WORLDS = TUNED_STACK.replace(SCAN_MATCHING_LOCALIZER, f"{{{ODOMETRY_LOCALIZER}}}")
"""TUNED_STACK without scan matching, because moving objects disturb it."""
DEFAULT_STACK = f"  localizer: {SCAN_MATCHING_LOCALIZER}\n"
"""YAML lines of `stack:` with the default controller at its default speed of 0.5 m/s."""
CONTROLLERS = {
    f"{name} at 0.5 m/s": f"  localizer: {SCAN_MATCHING_LOCALIZER}\n  costmap: {COSTMAP}\n  controller: {parameters}\n"
    for name, parameters in (
        ("regulated pure pursuit", "{type: regulated_pure_pursuit, desired_linear_vel: 0.5 m/s}"),
        ("dwb", "{type: dwb, max_vel_x: 0.5 m/s}"),
        ("mppi", "{type: mppi, vx_max: 0.5 m/s}"),
    )
}
"""YAML lines of `stack:` for each shipped controller at 0.5 m/s, the speed of the published results."""

SCENARIO_TEMPLATE = """\
map: none
robot: {model: jackal, pose: <start>}
stack:
<stack>goals:
  - {name: beyond, pose: <goal>, xy_tolerance: 0.5 m, yaw_tolerance: 180 deg}
time_limit: 100 s
linger: 0
events:
  - {name: contact ends the run, when: {collision: {}}, do: {cancel_goal: {}}, required: false}
pass:
  - goals_reached: {tolerance: 1 m}
  - collisions: {max: 0}
"""
"""YAML of a scenario without name and world. `<start>`, `<stack>`, and `<goal>` are placeholders."""


@dataclass(frozen=True)
class BarnWorld:
    """World file of the BARN challenge, and the length in m of the reference path for the BARN score."""

    file: Path
    reference_length: float


def read_barn_worlds(folder: Path) -> list[BarnWorld]:
    """Return the worlds listed in the file scenarios.csv in `folder`. Raises UsageError if it is missing or invalid."""
    file = folder / "scenarios.csv"
    try:
        with file.open(newline="", encoding="utf-8") as lines:
            worlds = list(_parse_rows(file, csv.DictReader(lines)))
    except (OSError, UnicodeDecodeError, csv.Error) as error:
        raise UsageError(f"cannot read the list of BARN's worlds: {error}") from error
    if not worlds:
        raise UsageError(f"{file}: lists no worlds")
    return worlds


def _parse_rows(file: Path, rows: Iterable[dict[str, str]]) -> Iterable[BarnWorld]:
    """Yield the world of each row of the CSV `file`. Raises UsageError for an invalid row."""
    for number, row in enumerate(rows, start=2):
        try:
            world, length = int(row["world"]), float(row["ref_path_len"])
        except KeyError as error:
            raise UsageError(f"{file}: no column {error}") from error
        except (TypeError, ValueError) as error:
            raise UsageError(f"{file}, line {number}: {error}") from error
        if not 0.0 < length < math.inf:
            raise UsageError(f"{file}, line {number}: a path is longer than 0 m, not {length:g}")
        yield BarnWorld(file.parent / f"world_{world}.world", length)


def scenario_text(name: str, world: str, start: Pose2 = START, goal: Pose2 = GOAL, stack: str = TUNED_STACK) -> str:
    """Return the YAML of a scenario. `world` is the value of `world:`, and `stack` the lines below `stack:`."""
    text = SCENARIO_TEMPLATE.replace("<stack>", stack).replace("<start>", _pose_yaml(start))
    return f"simscen: 1\nname: {name}\nworld: {world}\n{text.replace('<goal>', _pose_yaml(goal))}"


def _pose_yaml(pose: Pose2) -> str:
    return f"{{x: {pose.x}, y: {pose.y}, yaw: {pose.yaw}}}"


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
"""Maximum number of random draws for a field or a path."""

Cells = npt.NDArray[np.bool_]
"""Array (rows, columns) that is true for filled cells."""


@dataclass(frozen=True, eq=False)
class ObstacleField:
    """Lane with cylinders at `centers` (n, 2). `shortest_path_m` is the length of the shortest path to GOAL."""

    number: int
    centers: Array
    shortest_path_m: float

    @property
    def density(self) -> float:
        """Fraction of filled cells of the obstacle field, without the walls."""
        inside = (np.abs(self.centers[:, 0] + COLUMNS * CELL_SIZE_M / 2) < (COLUMNS / 2 - 1) * CELL_SIZE_M) & (
            self.centers[:, 1] > (ROWS - FIELD_ROWS) * CELL_SIZE_M
        )
        return float(np.count_nonzero(inside)) / (FIELD_ROWS * (COLUMNS - 2))


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
        neighbors = _count_neighbors(cells)
        cells = (cells | (neighbors >= FILL_NEIGHBORS)) & (neighbors > CLEAR_NEIGHBORS)
    cells[:, [0, -1]] = True
    return cells


def _count_neighbors(cells: Cells) -> npt.NDArray[np.int64]:
    """Return the number of filled neighbors of each cell. Cells beyond the edge count as empty."""
    padded = np.pad(cells.astype(np.int64), 1)
    rows, columns = cells.shape
    filled = sum(padded[i : i + rows, j : j + columns] for i in range(3) for j in range(3))
    return np.asarray(filled - cells)


def _cylinder_centers(field: Cells) -> Array:
    """Return the centers (n, 2) of all cylinders of the lane: the field, side walls, and a wall behind the start."""
    lane = np.zeros((ROWS, COLUMNS), np.bool_)
    lane[:, [0, -1]], lane[0] = True, True
    lane[ROWS - FIELD_ROWS :] = field
    rows, columns = np.nonzero(lane)
    return np.column_stack(((columns + 0.5 - COLUMNS) * CELL_SIZE_M, (rows + 0.5) * CELL_SIZE_M))


def _is_crossable(centers: Array, crossing_radius: float, blocked_radius: float | None) -> bool:
    """Return whether a disc of `crossing_radius` can move from START to GOAL, but a disc of `blocked_radius` cannot."""
    from scipy import ndimage, spatial

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
    from simscen.worlds.geometry.triangulation import merge_solids
    from simscen.worlds.routes.shortest_paths import ShortestPaths

    pillar = Cylinder(CELL_SIZE_M / 2, HEIGHT_M)
    mesh = merge_solids(tuple(Solid(pillar, Pose3(x, y, HEIGHT_M / 2), "") for x, y in centers.tolist()))
    # The bounds are as wide as the lane, because a path could lead around the walls, which end with the field.
    bounds = (-COLUMNS * CELL_SIZE_M, 0.0, 0.0, GOAL.y + 1.0)
    return ShortestPaths(mesh, bounds, radius).length(START, GOAL)


ARENA_HALF_WIDTH_M = 10.0
"""Half of the side of DynaBARN's square arena. The center of the arena is the origin."""
MOVER_RADIUS_M = 0.5
"""Radius of a moving cylinder."""
MOVER_COUNT_RANGE = (5, 24)
"""Smallest and largest number of moving cylinders in a field."""
SPEEDS_M_S = (0.74, 1.23, 1.72)
"""Mean speeds of the easy, medium and hard worlds of DynaBARN."""
MAX_SPEED_DEVIATION_M_S = 0.25
"""Maximum deviation of a cylinder's mean speed from the field's, and of a cylinder's speed from its mean speed."""
SPEED_STD_RANGE_M_S = (0.05, 0.25)
"""Range of the standard deviation of a cylinder's speeds."""
DEGREE_RANGE = (1, 5)
"""Range of the degree of the polynomial that a cylinder follows."""
KEYFRAME_DISTANCE_M = 2.0
"""Approximate distance between two keyframes of a cylinder's motion."""
MIN_PATH_LENGTH_M = 8.0
"""Minimum length of a cylinder's path."""
DYNABARN_START, DYNABARN_GOAL = Pose2(11.0, 0.0, 3.14159), Pose2(-9.0, 0.0, 3.14159)
"""Start of the robot in DynaBARN, 1 m outside of the arena, and goal of the robot inside."""


@dataclass(frozen=True, eq=False)
class Mover:
    """Cylinder that moves back and forth along `points` (n, 2), which it passes at `times` (n,) in s.

    At the start of a run, `phase` seconds of this motion have already passed.
    """

    times: Array
    points: Array
    phase: float


@dataclass(frozen=True, eq=False)
class DynamicField:
    """Field of moving cylinders. Their mean speeds deviate randomly from `speed` in m/s."""

    number: int
    speed: float
    movers: tuple[Mover, ...]


def generate_dynamic_field(number: int, speed: float) -> DynamicField:
    """Generate the field with this number (from 1) and mean speed in m/s. The result depends on the arguments only."""
    rng = Streams(number).generator(f"dynamic field {speed:g}")
    count = int(rng.integers(MOVER_COUNT_RANGE[0], MOVER_COUNT_RANGE[1] + 1))
    return DynamicField(number, speed, tuple(_random_mover(rng, speed) for _ in range(count)))


def _random_mover(rng: np.random.Generator, speed: float) -> Mover:
    """Return a cylinder on a random path with random speeds. `speed` is the mean speed of the field in m/s."""
    points = _random_path(rng)
    mean = speed + float(rng.uniform(-MAX_SPEED_DEVIATION_M_S, MAX_SPEED_DEVIATION_M_S))
    deviation = float(rng.uniform(*SPEED_STD_RANGE_M_S))
    steps = np.hypot(*np.diff(points, axis=0).T)
    speeds = np.clip(
        rng.normal(mean, deviation, len(steps)), mean - MAX_SPEED_DEVIATION_M_S, mean + MAX_SPEED_DEVIATION_M_S
    )
    times = np.concatenate(([0.0], np.cumsum(steps / speeds)))
    return Mover(times, points, float(rng.uniform(0.0, 1.99 * times[-1])))


def _random_path(rng: np.random.Generator) -> Array:
    """Return points (n, 2) along a random polynomial y(x) or x(y), about KEYFRAME_DISTANCE_M apart.

    Raises RuntimeError if no path with MIN_PATH_LENGTH_M is found.
    """
    for _ in range(MAX_ATTEMPTS):
        curve = _polynomial_in_arena(rng)
        length_at = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(curve, axis=0).T))))
        if length_at[-1] < MIN_PATH_LENGTH_M:
            continue
        lengths = np.linspace(0.0, length_at[-1], round(length_at[-1] / KEYFRAME_DISTANCE_M) + 1)
        points = np.column_stack([np.interp(lengths, length_at, axis) for axis in curve.T])
        points = points[:, ::-1] if rng.integers(2) else points
        return points[::-1] if rng.integers(2) else points
    raise RuntimeError(f"none of {MAX_ATTEMPTS} polynomials stays within the arena for {MIN_PATH_LENGTH_M:g} m")


def _polynomial_in_arena(rng: np.random.Generator) -> Array:
    """Return points (n, 2) along a random polynomial y(x): the longest piece within the arena."""
    order = int(rng.integers(DEGREE_RANGE[0], DEGREE_RANGE[1] + 1))
    # Spread over the arena, so that the polynomial does not oscillate between points that nearly coincide.
    edges = np.linspace(-ARENA_HALF_WIDTH_M, ARENA_HALF_WIDTH_M, order + 2)
    x_points = rng.uniform(edges[:-1], edges[1:])
    polynomial = np.polynomial.Polynomial.fit(
        x_points, rng.uniform(-ARENA_HALF_WIDTH_M, ARENA_HALF_WIDTH_M, order + 1), order
    )
    x = np.linspace(-ARENA_HALF_WIDTH_M, ARENA_HALF_WIDTH_M, 401)
    y = polynomial(x)
    outside = np.flatnonzero(np.abs(y) > ARENA_HALF_WIDTH_M)
    pieces = np.split(np.column_stack((x, y)), outside)
    inside = [piece[np.abs(piece[:, 1]) <= ARENA_HALF_WIDTH_M] for piece in pieces]
    return max(inside, key=len)
