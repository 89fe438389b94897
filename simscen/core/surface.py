"""Patches of floor on which wheels hold less, or more, than on dry concrete."""

import math
from dataclasses import dataclass

from simscen.core.world import Polygon

CIRCLE = 32
"""Corners of the polygon that stands for a round patch."""


@dataclass(frozen=True)
class Patch:
    """A piece of floor: its `outline`, its `friction` against rubber wheels, and the tick at which it is over."""

    outline: Polygon
    friction: float
    until: float = math.inf


def disc(centre: tuple[float, float], radius: float) -> Polygon:
    """The outline of a round patch."""
    turns = [2 * math.pi * k / CIRCLE for k in range(CIRCLE)]
    return tuple((centre[0] + radius * math.cos(turn), centre[1] + radius * math.sin(turn)) for turn in turns)
