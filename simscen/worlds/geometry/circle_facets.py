"""Number of facets with which a circle is approximated."""

import math

MAX_SAGITTA_M = 0.0005
"""Greatest depth by which a facet cuts into a circle: half of the resolution of lidars."""
FACETS = (12, 192)
"""Smallest and greatest number of facets of a circle."""


def facet_count(radius: float, sagitta: float = MAX_SAGITTA_M) -> int:
    """Return the number of facets with which no facet cuts deeper than `sagitta` m; a multiple of 4, within FACETS.

    A chord over the angle 2π/n cuts r (1 - cos(π/n)) into a circle. With a multiple of 4 the extents along
    x and y are exact.
    """
    fewest, most = FACETS
    needed = math.pi / math.acos(1 - sagitta / radius) if radius > sagitta else fewest
    return int(min(most, max(fewest, 4 * math.ceil(needed / 4))))
