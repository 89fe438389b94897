"""The forces of the social force model, each an acceleration in m/s², for many people at once.

Sources: [HM95] Helbing and Molnár, Social force model for pedestrian dynamics, Physical Review E 51, 1995.
[M09] Moussaïd, Helbing, Garnier, Johansson, Combe, Theraulaz, Experimental study of the behavioural mechanisms
underlying self-organization in human crowds, Proceedings of the Royal Society B 276, 2009. [M10] Moussaïd, Perozo,
Garnier, Helbing, Theraulaz, The walking behaviour of pedestrian social groups and its impact on crowd dynamics, PLoS
ONE 5(4), 2010.
"""

import math

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array

Numbers = npt.NDArray[np.int64]

RELAXATION_TIME = 0.54
"""τ in s [M09: 0.54 ± 0.05]."""
DESIRED_SPEED, SPREAD = 1.29, 0.19
"""Mean and standard deviation in m/s of how fast people like to walk [M09]."""
MOST_OF_SPEED = 1.3
"""Nobody walks faster than this many times the speed they like [HM95]."""

SOCIAL = 4.5
"""A in m/s² [M09]."""
LAMBDA = 2.0
"""λ in s/m: the weight of relative motion against relative place [M09]."""
GAMMA = 0.35
"""γ in m: the range of the interaction, B = γ|D| [M09]."""
N_TURN, N_BRAKE = 2.0, 3.0
"""n and n′ in 1/m: how narrowly the turning and the braking force look ahead [M09]."""
SIDE = 0.005
"""ε in rad/m: the side to which people turn who meet exactly head-on, which is the right [M09]."""

WALL, WALL_RANGE = 3.0, 0.1
"""a in m/s² and b in m [M09]."""

GAZE, COHERENCE, REPULSION = 4.0, 3.0, 1.0
"""β₁ in 1/(rad s), β₂ and β₃ in m/s² [M10]."""
VISION = math.pi / 2
"""rad to each side that somebody sees the others of a group without turning the head [M10]."""
GROUP_GAP = 0.8
"""m between the middles of two of a group below which they make room for each other [M10]."""


def social(towards: Array, closing: Array, wider: Array) -> Array:
    """What somebody at whom others come does (n, 2): brakes along D, and turns aside.

    `towards` (n, 2) leads from them to the other in metres, `closing` (n, 2) is their own velocity less the other's in
    m/s, `wider` (n,) how much wider than a person's the other's body is, in metres: so much nearer is it.
    """
    apart = np.hypot(towards[:, 0], towards[:, 1])
    distance = np.maximum(apart, 1e-6)
    along = towards / distance[:, np.newaxis]
    interaction = LAMBDA * closing + along
    length = np.maximum(np.hypot(interaction[:, 0], interaction[:, 1]), 1e-6)
    t = interaction / length[:, np.newaxis]
    left = np.stack((-t[:, 1], t[:, 0]), axis=1)
    reach = GAMMA * length
    angle = np.arctan2(np.sum(left * along, axis=1), np.sum(t * along, axis=1)) + SIDE * reach
    fall = SOCIAL * np.exp(-np.maximum(distance - wider, 0.0) / reach)
    brake = fall * np.exp(-((N_BRAKE * reach * angle) ** 2))
    turn = fall * np.exp(-((N_TURN * reach * angle) ** 2)) * np.where(angle < 0, -1.0, 1.0)
    force: Array = -brake[:, np.newaxis] * t - turn[:, np.newaxis] * left
    return force


def wall(away: Array, gap: Array) -> Array:
    """What keeps somebody off a wall or a thing (n, 2): `away` from it, over `gap` (n,) metres of air."""
    force: Array = (WALL * np.exp(-np.maximum(gap, 0.0) / WALL_RANGE))[:, np.newaxis] * away
    return force


def group(places: Array, velocities: Array, members: Numbers) -> Array:
    """What keeps a group together (n, 2): `members` are the numbers of those who belong to it, at least two."""
    force = np.zeros_like(places)
    here = places[members]
    count = len(members)
    middle = here.sum(axis=0) / count
    for number, member in enumerate(members.tolist()):
        others = (middle * count - here[number]) / (count - 1) - here[number]
        force[member] -= GAZE * _head_turn(velocities[member], others) * velocities[member]
        to_middle = middle - here[number]
        distance = math.hypot(*to_middle)
        if distance > (count - 1) / 2:
            force[member] += COHERENCE * to_middle / distance
        gaps = here[number] - here
        near = np.hypot(gaps[:, 0], gaps[:, 1])
        close = (near < GROUP_GAP) & (near > 0)
        force[member] += REPULSION * (gaps[close] / near[close, np.newaxis]).sum(axis=0)
    return force


def _head_turn(velocity: Array, others: Array) -> float:
    """Radians that somebody has to turn the head beyond VISION to have the others of the group in view."""
    if not velocity.any() or not others.any():
        return 0.0
    turn = abs(math.atan2(velocity[0] * others[1] - velocity[1] * others[0], float(velocity @ others)))
    return max(0.0, turn - VISION)
