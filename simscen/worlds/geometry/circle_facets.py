"""Number of facets of round shapes. Triangle meshes and upright prisms use the same number."""

import math

MAX_SAGITTA_M = 0.0005
"""Greatest depth by which a facet cuts into a circle: half of the resolution of lidars."""
FACET_COUNT_RANGE = (12, 192)
"""Smallest and greatest number of facets of a circle."""


def facet_count(radius: float, max_sagitta: float = MAX_SAGITTA_M) -> int:
    """Return the number of facets with which no facet cuts deeper than `max_sagitta` m into a circle.

    The result is a multiple of 4 within FACET_COUNT_RANGE. A chord over the angle 2π/n cuts r (1 - cos(π/n)) into a
    circle. With a multiple of 4 the extents along x and y are exact.
    """
    fewest, most = FACET_COUNT_RANGE
    needed = math.pi / math.acos(1 - max_sagitta / radius) if radius > max_sagitta else fewest
    return int(min(most, max(fewest, 4 * math.ceil(needed / 4))))
