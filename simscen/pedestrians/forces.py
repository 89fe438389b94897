"""The forces of the social force model, each an acceleration in m/s², for many people at once.

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

Numbers = npt.NDArray[np.int64]

RELAXATION_TIME = 0.54
"""τ in s [M09: 0.54 ± 0.05]."""
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
    """Return the social forces (n, 2) on pedestrians that others approach: deceleration along D, and evasion.

    `towards` (n, 2) points from the pedestrian to the other in m, `closing` (n, 2) is the pedestrian's velocity minus
    the other's in m/s, and `wider` (n,) is the additional radius in m of the other compared with a pedestrian.
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
    """Return the repulsive forces (n, 2) of walls and objects in direction `away`, at distances `gap` (n,) in m."""
    force: Array = (WALL * np.exp(-np.maximum(gap, 0.0) / WALL_RANGE))[:, np.newaxis] * away
    return force


def group(places: Array, velocities: Array) -> Array:
    """Return the forces (n, 2) that keep the members of a group together, computed with scalars for small groups."""
    here, moving = places.tolist(), velocities.tolist()
    count = len(here)
    mx, my = sum(x for x, _ in here) / count, sum(y for _, y in here) / count
    forces = []
    for (x, y), (vx, vy) in zip(here, moving, strict=True):
        share = count / (count - 1)  # the middle of the others is so many times as far away as that of all
        turn = GAZE * _head_turn(vx, vy, share * (mx - x), share * (my - y))
        fx, fy, distance = -turn * vx, -turn * vy, math.hypot(mx - x, my - y)
        if distance > (count - 1) / 2:
            fx, fy = fx + COHERENCE * (mx - x) / distance, fy + COHERENCE * (my - y) / distance
        for ox, oy in here:
            gap = math.hypot(x - ox, y - oy)
            if 0 < gap < GROUP_GAP:
                fx, fy = fx + REPULSION * (x - ox) / gap, fy + REPULSION * (y - oy) / gap
        forces.append((fx, fy))
    return np.array(forces)


def _head_turn(vx: float, vy: float, x: float, y: float) -> float:
    """Radians that who walks at (vx, vy) has to turn the head beyond VISION to have (x, y) in view."""
    if (vx == 0 and vy == 0) or (x == 0 and y == 0):
        return 0.0
    return max(0.0, abs(math.atan2(vx * y - vy * x, vx * x + vy * y)) - VISION)


MAX_PROJECTIONS = 8
"""Times that a move is cut down by one limit after another, before all of it is shortened."""


class MoveLimits(NamedTuple):
    """Person `who` (n,) may move by at most `most` (n,) meters along the unit vector `towards` (n, 2)."""

    who: Numbers
    towards: Array
    most: Array


def move_limits(who: Numbers, towards: Array, gap: Array, share: float = 1.0) -> MoveLimits:
    """Of what is `gap` (n,) meters away: a `share` of that, and nothing when it touches already.

    What is convex stays apart from who keeps to this: its side of the plane in between is its own.
    """
    return MoveLimits(who, towards, share * np.maximum(gap, 0.0))


def clip_moves(moves: Array, every: Iterable[MoveLimits]) -> Array:
    """Return the moves (n, 2) restricted to the limits, with sliding along them where possible."""
    parts = list(every)
    who = np.concatenate([part.who for part in parts])
    towards = np.concatenate([part.towards for part in parts])
    most = np.concatenate([part.most for part in parts])
    over = np.sum(moves[who] * towards, axis=1) > most
    kept: Array = moves.copy()
    for person in np.unique(who[over]).tolist():
        mine = who == person
        kept[person] = _cut(kept[person], towards[mine], most[mine])
    return kept


def _cut(move: Array, towards: Array, most: Array) -> Array:
    for _ in range(MAX_PROJECTIONS):
        excess: Array = (towards * move).sum(axis=1) - most
        worst = int(np.argmax(excess))
        if excess[worst] <= 0:
            break
        move = np.subtract(move, excess[worst] * towards[worst])
    along = (towards * move).sum(axis=1)
    tight = along > most
    shorter: Array = move * float((most[tight] / along[tight]).min(initial=1.0))
    return shorter
