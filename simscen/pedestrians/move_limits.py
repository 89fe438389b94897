"""What keeps bodies out of each other: nobody moves nearer to anything than there is room, however they are pushed."""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from simscen.core.geometry import Array
from simscen.pedestrians.forces import Numbers

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
    """The moves (n, 2) cut down to what the limits leave, sliding along where that is possible."""
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
