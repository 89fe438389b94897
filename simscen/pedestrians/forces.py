"""Forces of the social force model as accelerations in m/s².

Sources: [HM95] Helbing and Molnár, Social force model for pedestrian dynamics, Physical Review E 51, 1995.
[M09] Moussaïd, Helbing, Garnier, Johansson, Combe, Theraulaz, Experimental study of the behavioral mechanisms
underlying self-organization in human crowds, Proceedings of the Royal Society B 276, 2009. [M10] Moussaïd, Perozo,
Garnier, Helbing, Theraulaz, The walking behavior of pedestrian social groups and its impact on crowd dynamics, PLoS
ONE 5(4), 2010.
"""

import math

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array

Indices = npt.NDArray[np.int64]
"""Indices (n,) into arrays or lists."""

RELAXATION_TIME_S = 0.54
"""Time constant with which pedestrians reach their intended velocity, τ [M09: 0.54 ± 0.05]."""
MAX_SPEED_RATIO = 1.3
"""Ratio of the maximum speed to the preferred speed [HM95]."""

SOCIAL_STRENGTH_M_S2 = 4.5
"""Maximum social force, A [M09]."""
VELOCITY_WEIGHT_S_PER_M = 2.0
"""Weight λ of the relative velocity in the interaction vector D = λ (v - v_other) + e [M09]. e is the unit vector from
the pedestrian to the other."""
RANGE_PER_INTERACTION_M = 0.35
"""Ratio γ of the interaction range B to the length of the interaction vector D [M09]."""
TURN_DECAY_PER_M, BRAKE_DECAY_PER_M = 2.0, 3.0
"""Angular decay rates n of the turning force and n′ of the braking force [M09]."""
HEAD_ON_BIAS_RAD_PER_M = 0.005
"""Bias ε of the angle, because of which pedestrians that meet exactly head-on evade to the right [M09]."""

WALL_STRENGTH_M_S2, WALL_RANGE_M = 3.0, 0.1
"""Force a of a wall at contact, and distance b over which the force falls to 1/e [M09]."""

GAZE_WEIGHT_PER_RAD_S, COHERENCE_M_S2, REPULSION_M_S2 = 4.0, 3.0, 1.0
"""Weights of the forces in a group [M10]: β₁ of the turn of the head, β₂ to the center, β₃ away from near members."""
HALF_VISION_RAD = math.pi / 2
"""Angle to each side in which a pedestrian sees its group without turning the head [M10]."""
MIN_GROUP_GAP_M = 0.8
"""Distance between the centers of two members of a group below which they repel each other [M10]."""


def social_forces(offsets: Array, relative_velocities: Array, extra_radii: Array) -> Array:
    """Return the forces (n, 2) with which pedestrians brake and turn to evade others.

    Each row is a pair of a pedestrian and "the other": another pedestrian, or a robot.

    offsets (n, 2):              vector in m from the pedestrian to the other
    relative_velocities (n, 2):  velocity of the pedestrian minus velocity of the other in m/s
    extra_radii (n,):            radius of the other in m minus crowd.REFERENCE_RADIUS_M
    """
    separation = np.hypot(offsets[:, 0], offsets[:, 1])
    distance = np.maximum(separation, 1e-6)
    along = offsets / distance[:, np.newaxis]
    interaction = VELOCITY_WEIGHT_S_PER_M * relative_velocities + along
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
    """Return the repulsive forces (n, 2) of walls and objects. Each row is a pair of a pedestrian and a wall or object.

    directions (n, 2):  unit vector from the wall or object to the pedestrian
    gaps (n,):          distance in m from the wall or object to the body of the pedestrian
    """
    force: Array = (WALL_STRENGTH_M_S2 * np.exp(-np.maximum(gaps, 0.0) / WALL_RANGE_M))[:, np.newaxis] * directions
    return force


def group_forces(positions: Array, velocities: Array) -> Array:
    """Return the forces (n, 2) that keep the members of one group together.

    `positions` (n, 2) are in m, `velocities` (n, 2) in m/s. There must be at least two members.
    """
    # Python floats are faster than arrays for small groups.
    points, point_velocities = positions.tolist(), velocities.tolist()
    count = len(points)
    mx, my = sum(x for x, _ in points) / count, sum(y for _, y in points) / count
    forces = []
    for (x, y), (vx, vy) in zip(points, point_velocities, strict=True):
        ratio = count / (count - 1)  # the center of the other members is farther away than the center of all members
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
    """Return the angle in rad by which a pedestrian with velocity (vx, vy) must turn its head to see a point.

    (x, y) is the offset of the point from the pedestrian in m.
    """
    if (vx == 0 and vy == 0) or (x == 0 and y == 0):
        return 0.0
    return max(0.0, abs(math.atan2(vx * y - vy * x, vx * x + vy * y)) - HALF_VISION_RAD)
