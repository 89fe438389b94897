"""Fields of moving cylinders as in DynaBARN: each goes to and fro along a polynomial through a 20 m arena.

Nair, Jiang, Hou, Xu, Li, Xiao, Stone: DynaBARN: Benchmarking Metric Ground Navigation in Dynamic Environments, SSRR
2022: 5 … 24 cylinders of 0.5 m radius, polynomials through random points from border to border, and between any two
points a speed of its own, drawn from a normal distribution. Theirs jump back to where they began; ours turn around.
"""

from dataclasses import dataclass

import numpy as np

from simscen.core.geometry import Array, Pose2
from simscen.core.random_streams import Streams

HALF = 10.0
"""Meters from the middle of the arena, which is square, to its border."""
RADIUS, HEIGHT = 0.5, 1.0
COUNT = (5, 24)
"""Least and most cylinders of a field."""
SPEEDS = (0.74, 1.23, 1.72)
"""Mean speeds in m/s of DynaBARN's easy, medium and hard worlds."""
SPREAD = 0.25
"""m/s by which a cylinder's mean speed differs from the field's at most; no piece of its way is driven at more off."""
DEVIATION = (0.05, 0.25)
"""Least and most standard deviation of a cylinder's speeds, in m/s."""
ORDER = (1, 5)
"""Least and most degree of the polynomials."""
PIECE = 2.0
"""Meters of way between two keyframes."""
LEAST_WAY = 8.0
"""Meters: a polynomial that leaves the arena sooner is drawn again."""
START, GOAL = Pose2(11.0, 0.0, 3.14159), Pose2(-9.0, 0.0, 3.14159)
"""Where DynaBARN's robot sets out, a meter outside the arena, and where it goes."""
MAX_ATTEMPTS = 1000


@dataclass(frozen=True, eq=False)
class Mover:
    """A cylinder's motion: at `times` (n,) in s its middle is at `points` (n, 2); there and back, for ever.

    It begins `phase` seconds into that.
    """

    times: Array
    points: Array
    phase: float


@dataclass(frozen=True, eq=False)
class DynamicField:
    """The cylinders of a field, and the mean `speed` in m/s that it was asked for."""

    number: int
    speed: float
    movers: tuple[Mover, ...]


def dynamic_field(number: int, speed: float) -> DynamicField:
    """The field of this number (from 1) and mean speed in m/s: always the same."""
    rng = Streams(number).generator(f"dynamic field {speed:g}")
    count = int(rng.integers(COUNT[0], COUNT[1] + 1))
    return DynamicField(number, speed, tuple(_mover(rng, speed) for _ in range(count)))


def _mover(rng: np.random.Generator, speed: float) -> Mover:
    points = _way(rng)
    mean = speed + float(rng.uniform(-SPREAD, SPREAD))
    deviation = float(rng.uniform(*DEVIATION))
    steps = np.hypot(*np.diff(points, axis=0).T)
    speeds = np.clip(rng.normal(mean, deviation, len(steps)), mean - SPREAD, mean + SPREAD)
    times = np.concatenate(([0.0], np.cumsum(steps / speeds)))
    return Mover(times, points, float(rng.uniform(0.0, 1.99 * times[-1])))


def _way(rng: np.random.Generator) -> Array:
    """Points (n, 2) about PIECE apart along a polynomial within the arena; every other one leads along y, or back.

    Raises RuntimeError after MAX_ATTEMPTS (never seen).
    """
    for _ in range(MAX_ATTEMPTS):
        way = _inside(rng)
        along = np.concatenate(([0.0], np.cumsum(np.hypot(*np.diff(way, axis=0).T))))
        if along[-1] < LEAST_WAY:
            continue
        at = np.linspace(0.0, along[-1], round(along[-1] / PIECE) + 1)
        points = np.column_stack((np.interp(at, along, way[:, 0]), np.interp(at, along, way[:, 1])))
        points = points[:, ::-1] if rng.integers(2) else points
        return points[::-1] if rng.integers(2) else points
    raise RuntimeError(f"none of {MAX_ATTEMPTS} polynomials stays within the arena for {LEAST_WAY:g} m")


def _inside(rng: np.random.Generator) -> Array:
    """The longest piece within the arena, as points (n, 2), of a polynomial through random points of it."""
    order = int(rng.integers(ORDER[0], ORDER[1] + 1))
    # Spread over the arena, so that the polynomial does not oscillate between points that nearly coincide.
    edges = np.linspace(-HALF, HALF, order + 2)
    through = rng.uniform(edges[:-1], edges[1:])
    polynomial = np.polynomial.Polynomial.fit(through, rng.uniform(-HALF, HALF, order + 1), order)
    x = np.linspace(-HALF, HALF, 401)
    y = polynomial(x)
    outside = np.flatnonzero(np.abs(y) > HALF)
    pieces = np.split(np.column_stack((x, y)), outside)
    kept = [piece[np.abs(piece[:, 1]) <= HALF] for piece in pieces]
    return max(kept, key=len)
