"""How round a circle is."""

import math

SAGITTA = 0.0005
"""How far in metres a facet may cut into a circle; half of the millimetre that lidars resolve."""
FACETS = (12, 192)
"""Fewest and most facets of a circle: a peg stays round, a gasometer affordable."""


def facets(radius: float, sagitta: float = SAGITTA) -> int:
    """How many facets a circle needs so that none cuts deeper than `sagitta`; a multiple of 4, within FACETS.

    A chord over the angle 2π/n cuts r (1 - cos(π/n)) into a circle. With a multiple of 4 the extents along
    x and y are exact.
    """
    fewest, most = FACETS
    needed = math.pi / math.acos(1 - sagitta / radius) if radius > sagitta else fewest
    return int(min(most, max(fewest, 4 * math.ceil(needed / 4))))
