"""Compute the forces of the social force model, as accelerations in m/s², and clip moves that would cause contact.

All functions are vectorized over pedestrians.

Sources: [HM95] Helbing and Molnár, Social force model for pedestrian dynamics, Physical Review E 51, 1995.
[M09] Moussaïd, Helbing, Garnier, Johansson, Combe, Theraulaz, Experimental study of the behavioral mechanisms
underlying self-organization in human crowds, Proceedings of the Royal Society B 276, 2009. [M10] Moussaïd, Perozo,
Garnier, Helbing, Theraulaz, The walking behavior of pedestrian social groups and its impact on crowd dynamics, PLoS
ONE 5(4), 2010.
"""

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array

Indices = npt.NDArray[np.int64]

RELAXATION_TIME_S = 0.54
"""Time constant with which pedestrians reach their intended velocity, τ [M09: 0.54 ± 0.05]."""
MAX_SPEED_RATIO = 1.3
"""Ratio of the maximum speed to the preferred speed [HM95]."""

SOCIAL_STRENGTH_M_S2 = 4.5
"""Largest social force, A [M09]."""
VELOCITY_WEIGHT_S_PER_M = 2.0
"""Weight λ of the relative velocity in the interaction vector D = λ (v - v_other) + unit vector to the other [M09]."""
RANGE_PER_INTERACTION_M = 0.35
"""Range of the interaction divided by the length of the interaction vector, γ: B = γ|D| [M09]."""
TURN_DECAY_PER_M, BRAKE_DECAY_PER_M = 2.0, 3.0
"""Angular decay of the turning and of the braking force, n and n′ [M09]."""
HEAD_ON_BIAS_RAD_PER_M = 0.005
"""Bias that makes pedestrians who meet exactly head-on evade to the right, ε [M09]."""

WALL_STRENGTH_M_S2, WALL_RANGE_M = 3.0, 0.1
"""Force of a wall at contact, a, and distance over which it decays, b [M09]."""

GAZE_WEIGHT_PER_RAD_S, COHERENCE_M_S2, REPULSION_M_S2 = 4.0, 3.0, 1.0
"""Weights in a group: turning the head β₁, moving to the center β₂, and keeping a distance β₃ [M10]."""
HALF_VISION_RAD = math.pi / 2
"""Angle to each side in which a pedestrian sees its group without turning the head [M10]."""
MIN_GROUP_GAP_M = 0.8
"""Distance between the centers of two members of a group below which they repel each other [M10]."""
MAX_PROJECTIONS = 8
"""Maximum number of limits that a move is projected onto before it is scaled down."""


def social_forces(towards: Array, closing: Array, extra_radii: Array) -> Array:
    """Return the forces (n, 2) that make pedestrians brake and turn to evade others, one for each pair.

    towards (n, 2):    vector in m from the pedestrian to the other
    closing (n, 2):    velocity of the pedestrian minus that of the other in m/s
    extra_radii (n,):  radius of the other in m minus crowd.REFERENCE_RADIUS_M, the radius that the model assumes
    """
    separation = np.hypot(towards[:, 0], towards[:, 1])
    distance = np.maximum(separation, 1e-6)
    along = towards / distance[:, np.newaxis]
    interaction = VELOCITY_WEIGHT_S_PER_M * closing + along
    length = np.maximum(np.hypot(interaction[:, 0], interaction[:, 1]), 1e-6)
    t = interaction / length[:, np.newaxis]
    left = np.stack((-t[:, 1], t[:, 0]), axis=1)
    interaction_range = RANGE_PER_INTERACTION_M * length
    angle = (
        np.arctan2(np.sum(left * along, axis=1), np.sum(t * along, axis=1)) + HEAD_ON_BIAS_RAD_PER_M * interaction_range
    )
    strength = SOCIAL_STRENGTH_M_S2 * np.exp(-np.maximum(distance - extra_radii, 0.0) / interaction_range)
    brake = strength * np.exp(-((BRAKE_DECAY_PER_M * interaction_range * angle) ** 2))
    turn = strength * np.exp(-((TURN_DECAY_PER_M * interaction_range * angle) ** 2)) * np.where(angle < 0, -1.0, 1.0)
    force: Array = -brake[:, np.newaxis] * t - turn[:, np.newaxis] * left
    return force


def wall_forces(directions: Array, gaps: Array) -> Array:
    """Return the repulsive forces (n, 2) of walls and objects, one for each pair of a pedestrian and a wall.

    `directions` (n, 2) are unit vectors away from the wall, `gaps` (n,) the distances in m between wall and body.
    """
    force: Array = (WALL_STRENGTH_M_S2 * np.exp(-np.maximum(gaps, 0.0) / WALL_RANGE_M))[:, np.newaxis] * directions
    return force


def group_forces(positions: Array, velocities: Array) -> Array:
    """Return the forces (n, 2) that keep the members of one group together, from their positions and velocities (n, 2).

    The forces are computed with Python floats, which is faster for small groups.
    """
    points, point_velocities = positions.tolist(), velocities.tolist()
    count = len(points)
    mx, my = sum(x for x, _ in points) / count, sum(y for _, y in points) / count
    forces = []
    for (x, y), (vx, vy) in zip(points, point_velocities, strict=True):
        ratio = count / (count - 1)  # of the distances to the centers of the others and of all
        turn = GAZE_WEIGHT_PER_RAD_S * _head_turn(vx, vy, ratio * (mx - x), ratio * (my - y))
        fx, fy, distance = -turn * vx, -turn * vy, math.hypot(mx - x, my - y)
        if distance > (count - 1) / 2:
            fx, fy = fx + COHERENCE_M_S2 * (mx - x) / distance, fy + COHERENCE_M_S2 * (my - y) / distance
        for ox, oy in points:
            gap = math.hypot(x - ox, y - oy)
            if 0 < gap < MIN_GROUP_GAP_M:
                fx, fy = fx + REPULSION_M_S2 * (x - ox) / gap, fy + REPULSION_M_S2 * (y - oy) / gap
        forces.append((fx, fy))
    return np.array(forces)


def _head_turn(vx: float, vy: float, x: float, y: float) -> float:
    """Return by how many rad a pedestrian with velocity (vx, vy) must turn the head to see in the direction (x, y)."""
    if (vx == 0 and vy == 0) or (x == 0 and y == 0):
        return 0.0
    return max(0.0, abs(math.atan2(vx * y - vy * x, vx * x + vy * y)) - HALF_VISION_RAD)


class MoveLimits(NamedTuple):
    """Limits of the moves of one step.

    pedestrians (n,):  index of the pedestrian that each limit applies to
    towards (n, 2):    unit vector along which the move is limited
    limits (n,):       maximum displacement in m along this vector
    """

    pedestrians: Indices
    towards: Array
    limits: Array


def move_limits(pedestrians: Indices, towards: Array, gaps: Array, ratio: float = 1.0) -> MoveLimits:
    """Return the limits that allow each pedestrian to use a `ratio` of the gap (m) to an obstacle; 0 if they touch.

    A pedestrian within these limits stays on its side of the plane between it and a convex obstacle.
    """
    return MoveLimits(pedestrians, towards, ratio * np.maximum(gaps, 0.0))


def clip_moves(moves: Array, all_limits: Iterable[MoveLimits]) -> Array:
    """Return the moves (n, 2) in m restricted to the limits; pedestrians slide along obstacles where possible."""
    parts = list(all_limits)
    pedestrians = np.concatenate([each.pedestrians for each in parts])
    towards = np.concatenate([each.towards for each in parts])
    limits = np.concatenate([each.limits for each in parts])
    exceeds = np.sum(moves[pedestrians] * towards, axis=1) > limits
    clipped: Array = moves.copy()
    for pedestrian in np.unique(pedestrians[exceeds]).tolist():
        own = pedestrians == pedestrian
        clipped[pedestrian] = _clip_move(clipped[pedestrian], towards[own], limits[own])
    return clipped


def _clip_move(move: Array, towards: Array, limits: Array) -> Array:
    """Return a move (2,) restricted to the limits (k,) along the unit vectors `towards` (k, 2)."""
    for _ in range(MAX_PROJECTIONS):
        excess: Array = (towards * move).sum(axis=1) - limits
        worst = int(np.argmax(excess))
        if excess[worst] <= 0:
            break
        move = np.subtract(move, excess[worst] * towards[worst])
    along = (towards * move).sum(axis=1)
    exceeded = along > limits
    shortened: Array = move * float((limits[exceeded] / along[exceeded]).min(initial=1.0))
    return shortened
