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
    """Return limits of the moves of one step. `positions` (n, 2) are the positions of the `people` in m.

    A pedestrian may use the entire gap to a wall, but only half of the gap to an object, robot, or pedestrian.
    """
    radii = np.array([person.spec.radius for person in people])
    pedestrians, _, points = walls
    limits = [_limits_towards(pedestrians, points - positions[pedestrians], radii[pedestrians], 1.0)]
    for kind, outlines in [
        *(("objects", item.outlines) for item in surroundings.objects),
        *(("robots", (robot.pose.apply(robot.outline),)) for robot in surroundings.robots),
    ]:
        aware = np.array([k for k, person in enumerate(people) if kind not in person.spec.blind_to], np.int64)
        pedestrians, points = nearest_outline_points(outlines, aware, positions, of_each_segment=True)
        limits.append(_limits_towards(pedestrians, points - positions[pedestrians], radii[pedestrians], 0.5))
    offsets = positions[np.newaxis] - positions[:, np.newaxis]
    distance = np.hypot(offsets[..., 0], offsets[..., 1])
    pedestrians, others = np.nonzero((distance < 2 * OBSTACLE_RANGE_M) & ~np.eye(len(people), dtype=np.bool_))
    between = offsets[pedestrians, others]
    return [*limits, _limits_towards(pedestrians, between, radii[pedestrians], 0.5, radii[others])]


def _limits_towards(
    pedestrians: Indices, offsets: Array, radii: Array, ratio: float, other_radii: Array | float = 0.0
) -> MoveLimits:
    """Return limits that allow each pedestrian (k,) to use the fraction `ratio` of the gap to an obstacle.

    `offsets` (k, 2) are vectors in m from the pedestrians to the obstacles. A gap is the distance minus the radius of
    the pedestrian (`radii`) and of the obstacle (`other_radii`) in m.
    """
    distance = np.maximum(np.hypot(offsets[:, 0], offsets[:, 1]), 1e-9)
    gaps = distance - radii - other_radii
    return MoveLimits(pedestrians, offsets / distance[:, np.newaxis], ratio * np.maximum(gaps, 0.0))


def clip_moves(moves: Array, all_limits: Iterable[MoveLimits]) -> Array:
    """Return the moves (n, 2) in m, restricted to all limits. Pedestrians slide along obstacles if possible."""
    all_limits = list(all_limits)
    pedestrians = np.concatenate([each.pedestrians for each in all_limits])
    directions = np.concatenate([each.directions for each in all_limits])
    limits = np.concatenate([each.limits for each in all_limits])
    exceeds = np.sum(moves[pedestrians] * directions, axis=1) > limits
    clipped: Array = moves.copy()
    for pedestrian in np.unique(pedestrians[exceeds]).tolist():
        applies = pedestrians == pedestrian
        clipped[pedestrian] = _clip_move(clipped[pedestrian], directions[applies], limits[applies])
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
