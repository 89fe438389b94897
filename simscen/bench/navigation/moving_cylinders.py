"""Generator of fields of moving cylinders like those of DynaBARN, and experiments with drives through these fields."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from simscen.bench.navigation.barn import TUNED_STACK, scenario_text
from simscen.bench.navigation.experiments import Drive, Experiment, write_text
from simscen.core.geometry import Array, Pose2
from simscen.core.random_streams import Streams

ARENA_HALF_WIDTH_M = 10.0
"""Half of the side of DynaBARN's square arena. The center of the arena is the origin."""
MOVER_RADIUS_M = 0.5
"""Radius of a moving cylinder."""
HEIGHT_M = 1.0
"""Height of a cylinder."""
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
START, GOAL = Pose2(11.0, 0.0, 3.14159), Pose2(-9.0, 0.0, 3.14159)
"""Start of the robot in DynaBARN, 1 m outside of the arena, and goal of the robot inside."""
STACK = TUNED_STACK.replace(", match_scans: true", "")
"""YAML lines of `stack:`: TUNED_STACK without scan matching, which moving objects would disturb."""
MAX_ATTEMPTS = 1000
"""Maximum number of random draws for a path."""


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
    degree = int(rng.integers(DEGREE_RANGE[0], DEGREE_RANGE[1] + 1))
    # The points are spread over the arena, because a polynomial through points close together oscillates.
    edges = np.linspace(-ARENA_HALF_WIDTH_M, ARENA_HALF_WIDTH_M, degree + 2)
    x_points = rng.uniform(edges[:-1], edges[1:])
    polynomial = np.polynomial.Polynomial.fit(
        x_points, rng.uniform(-ARENA_HALF_WIDTH_M, ARENA_HALF_WIDTH_M, degree + 1), degree
    )
    x = np.linspace(-ARENA_HALF_WIDTH_M, ARENA_HALF_WIDTH_M, 401)
    y = polynomial(x)
    outside = np.flatnonzero(np.abs(y) > ARENA_HALF_WIDTH_M)
    pieces = np.split(np.column_stack((x, y)), outside)
    inside = [piece[np.abs(piece[:, 1]) <= ARENA_HALF_WIDTH_M] for piece in pieces]
    return max(inside, key=len)


def write_dynamic_fields(folder: Path, numbers: Sequence[int]) -> list[Experiment]:
    """Write one experiment for each of SPEEDS_M_S, with the generated fields of these numbers."""
    experiments = []
    for speed in SPEEDS_M_S:
        drives = []
        for number in numbers:
            stem = f"dynamic/field_{number}_at_{speed:.2f}"
            world = write_text(folder / f"{stem}.world.yaml", _world_text(generate_dynamic_field(number, speed)))
            text = scenario_text(f"dynamic field {number}", world.name, START, GOAL, STACK)
            drives.append(Drive(write_text(folder / f"{stem}.scenario.yaml", text), [number], START.distance(GOAL)))
        experiments.append(Experiment(dynamic_fields_name(speed), tuple(drives), folder, is_mapless=True))
    return experiments


def dynamic_fields_name(speed: float) -> str:
    """Return the name of the experiment for one of SPEEDS_M_S."""
    return f"dynamic fields, {speed:.2f} m/s"


def _world_text(field: DynamicField) -> str:
    lines = []
    for number, mover in enumerate(field.movers, start=1):
        keyframes = ", ".join(
            f"[{time:.3f}, {x:.3f}, {y:.3f}, 0]"
            for time, (x, y) in zip(mover.times.tolist(), mover.points.tolist(), strict=True)
        )
        x, y = mover.points[0].tolist()
        lines.append(
            f"  - name: cylinder {number}\n    cylinder: [{MOVER_RADIUS_M:g}, {HEIGHT_M:g}]\n"
            f"    pose: {{x: {x:.3f}, y: {y:.3f}}}\n    move:\n      keyframes: [{keyframes}]\n"
            f"      repeat: back_and_forth\n      ease: spline\n      phase: {mover.phase:.3f} s\n"
        )
    return f"simscen: 1\nname: dynamic field {field.number}\nobjects:\n{''.join(lines)}"
