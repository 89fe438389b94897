"""Fields of moving cylinders as in DynaBARN. Each cylinder moves back and forth along a polynomial in a 20 m arena.

Nair, Jiang, Hou, Xu, Li, Xiao, Stone: DynaBARN: Benchmarking Metric Ground Navigation in Dynamic Environments, SSRR
2022: 5 to 24 cylinders with a radius of 0.5 m move along polynomials through random points. The speed between points is
drawn from a normal distribution. The cylinders of DynaBARN jump back to their start at the end; these turn around.
"""

from dataclasses import dataclass

import numpy as np

from simscen.core.geometry import Array, Pose2
from simscen.core.random_streams import Streams

ARENA_HALF_WIDTH_M = 10.0
"""Half of the side length of the square arena."""
RADIUS_M, HEIGHT_M = 0.5, 1.0
COUNT_RANGE = (5, 24)
"""Smallest and largest number of cylinders."""
SPEEDS_M_S = (0.74, 1.23, 1.72)
"""Mean speeds of the easy, medium and hard worlds of DynaBARN."""
MAX_SPEED_DEVIATION_M_S = 0.25
"""Largest difference of a cylinder's mean speed from the field's, and of its speeds from its mean speed."""
SPEED_STD_RANGE_M_S = (0.05, 0.25)
"""Range of the standard deviation of a cylinder's speeds."""
DEGREE_RANGE = (1, 5)
"""Range of the degree of the polynomials."""
KEYFRAME_DISTANCE_M = 2.0
"""Distance between two keyframes."""
MIN_PATH_LENGTH_M = 8.0
"""Minimum length of a path in the arena. Shorter paths are drawn again."""
START, GOAL = Pose2(11.0, 0.0, 3.14159), Pose2(-9.0, 0.0, 3.14159)
"""Start of the robot in DynaBARN, 1 m outside of the arena, and its goal."""
MAX_ATTEMPTS = 1000


@dataclass(frozen=True, eq=False)
class Mover:
    """Motion of a cylinder through `points` (n, 2) at `times` (n,) in s, back and forth.

    The run starts `phase` seconds after the start of the motion.
    """

    times: Array
    points: Array
    phase: float


@dataclass(frozen=True, eq=False)
class DynamicField:
    """Moving cylinders of a field, and their requested mean `speed` in m/s."""

    number: int
    speed: float
    movers: tuple[Mover, ...]


def dynamic_field(number: int, speed: float) -> DynamicField:
    """Generate the field with this number (from 1) and mean speed in m/s. The result depends on nothing else."""
    rng = Streams(number).generator(f"dynamic field {speed:g}")
    count = int(rng.integers(COUNT_RANGE[0], COUNT_RANGE[1] + 1))
    return DynamicField(number, speed, tuple(_mover(rng, speed) for _ in range(count)))


def _mover(rng: np.random.Generator, speed: float) -> Mover:
    points = _path(rng)
    mean = speed + float(rng.uniform(-MAX_SPEED_DEVIATION_M_S, MAX_SPEED_DEVIATION_M_S))
    deviation = float(rng.uniform(*SPEED_STD_RANGE_M_S))
    steps = np.hypot(*np.diff(points, axis=0).T)
    speeds = np.clip(
        rng.normal(mean, deviation, len(steps)), mean - MAX_SPEED_DEVIATION_M_S, mean + MAX_SPEED_DEVIATION_M_S
    )
    times = np.concatenate(([0.0], np.cumsum(steps / speeds)))
    return Mover(times, points, float(rng.uniform(0.0, 1.99 * times[-1])))


def _path(rng: np.random.Generator) -> Array:
    """Return points (n, 2) about KEYFRAME_DISTANCE_M apart along a polynomial, with random axis and direction.

    Raises RuntimeError after MAX_ATTEMPTS, which never happened so far.
    """
    for _ in range(MAX_ATTEMPTS):
        curve = _polynomial_in_arena(rng)
        length_at = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(curve, axis=0).T))))
        if length_at[-1] < MIN_PATH_LENGTH_M:
            continue
        lengths = np.linspace(0.0, length_at[-1], round(length_at[-1] / KEYFRAME_DISTANCE_M) + 1)
        points = np.column_stack(
            (np.interp(lengths, length_at, curve[:, 0]), np.interp(lengths, length_at, curve[:, 1]))
        )
        points = points[:, ::-1] if rng.integers(2) else points
        return points[::-1] if rng.integers(2) else points
    raise RuntimeError(f"none of {MAX_ATTEMPTS} polynomials stays within the arena for {MIN_PATH_LENGTH_M:g} m")


def _polynomial_in_arena(rng: np.random.Generator) -> Array:
    """Return the longest piece, in the arena, of a polynomial through random points, as points (n, 2)."""
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
