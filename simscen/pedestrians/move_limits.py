"""Limits of the moves of pedestrians that prevent contact with walls, objects, robots, and other pedestrians."""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from simscen.core.geometry import Array
from simscen.pedestrians.forces import Indices
from simscen.pedestrians.pedestrian import Pedestrian
from simscen.pedestrians.surroundings import OBSTACLE_RANGE_M, NearestPoints, Surroundings, nearest_outline_points

MAX_PROJECTIONS = 8
"""Maximum number of limits that a move is projected onto. A move that still exceeds a limit is scaled down."""


class MoveLimits(NamedTuple):
    """Limits of the moves of pedestrians in one step, one per row.

    pedestrians (n,):   index of the pedestrian that the limit applies to
    directions (n, 2):  unit vector along which the move is limited
    limits (n,):        maximum displacement in m along this vector
    """

    pedestrians: Indices
    directions: Array
    limits: Array


def move_limits(
    people: Sequence[Pedestrian], positions: Array, surroundings: Surroundings, walls: NearestPoints
) -> list[MoveLimits]:
    """Return limits of the moves of one step. `positions` (n, 2) in m belong to the `people`.

    A pedestrian may use the entire gap to a wall, but only half of the gap to an object, robot, or pedestrian.
    """
    radii = np.array([person.spec.radius for person in people])
    near, _, points = walls
    limits = [_limits_towards(near, points - positions[near], radii[near], 1.0)]
    for kind, outlines in [
        *(("objects", item.outlines) for item in surroundings.objects),
        *(("robots", (robot.pose.apply(robot.outline),)) for robot in surroundings.robots),
    ]:
        aware = np.array([k for k, person in enumerate(people) if kind not in person.spec.blind_to], np.int64)
        near, points = nearest_outline_points(outlines, aware, positions, of_each_segment=True)
        limits.append(_limits_towards(near, points - positions[near], radii[near], 0.5))
    towards = positions[np.newaxis] - positions[:, np.newaxis]
    distance = np.hypot(towards[..., 0], towards[..., 1])
    one, other = np.nonzero((distance < 2 * OBSTACLE_RANGE_M) & ~np.eye(len(people), dtype=np.bool_))
    return [*limits, _limits_towards(one, towards[one, other], radii[one], 0.5, radii[other])]


def _limits_towards(
    pedestrians: Indices, towards: Array, radii: Array, ratio: float, other_radii: Array | float = 0.0
) -> MoveLimits:
    """Return limits that allow pedestrians (k,) to use a `ratio` of their gaps to other points.

    `towards` (k, 2) are the vectors in m to these points. The gap is the distance minus `radii` (k,) and `other_radii`
    (k,) in m.
    """
    distance = np.maximum(np.hypot(towards[:, 0], towards[:, 1]), 1e-9)
    gaps = distance - radii - other_radii
    return MoveLimits(pedestrians, towards / distance[:, np.newaxis], ratio * np.maximum(gaps, 0.0))


def clip_moves(moves: Array, all_limits: Iterable[MoveLimits]) -> Array:
    """Return the moves (n, 2) in m, restricted to the limits. Pedestrians slide along obstacles if possible."""
    parts = list(all_limits)
    pedestrians = np.concatenate([each.pedestrians for each in parts])
    directions = np.concatenate([each.directions for each in parts])
    limits = np.concatenate([each.limits for each in parts])
    exceeds = np.sum(moves[pedestrians] * directions, axis=1) > limits
    clipped: Array = moves.copy()
    for pedestrian in np.unique(pedestrians[exceeds]).tolist():
        own = pedestrians == pedestrian
        clipped[pedestrian] = _clip_move(clipped[pedestrian], directions[own], limits[own])
    return clipped


def _clip_move(move: Array, directions: Array, limits: Array) -> Array:
    """Return a move (2,) in m, restricted to the limits (k,) in m along the unit vectors `directions` (k, 2)."""
    for _ in range(MAX_PROJECTIONS):
        excess: Array = (directions * move).sum(axis=1) - limits
        worst = int(np.argmax(excess))
        if excess[worst] <= 0:
            break
        move = np.subtract(move, excess[worst] * directions[worst])
    along = (directions * move).sum(axis=1)
    exceeded = along > limits
    shortened: Array = move * float((limits[exceeded] / along[exceeded]).min(initial=1.0))
    return shortened
