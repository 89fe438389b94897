"""Detects bodies whose simulation has diverged: below the floor, too far away, or with a non-finite pose."""

import math

MAX_SUNK_DEPTH_M = 0.2
"""Largest valid depth in m of the center of a body below the floor."""
MAX_COORDINATE_M = 1e5
"""Largest valid coordinate in m."""


def divergence_reason(body_name: str, x: float, y: float, z: float, sum_of_others: float) -> str | None:
    """Return a sentence with the reason why the state of a body is invalid, or None if the state is valid.

    `x`, `y`, and `z` are the position of the body's center in m. `sum_of_others` is the sum of all other numbers of the
    state, such as velocities. The sum is not finite if any of these numbers is not finite.
    """
    if (
        -MAX_SUNK_DEPTH_M <= z <= MAX_COORDINATE_M
        and -MAX_COORDINATE_M <= x <= MAX_COORDINATE_M
        and -MAX_COORDINATE_M <= y <= MAX_COORDINATE_M
        and math.isfinite(sum_of_others)
    ):
        return None
    if not math.isfinite(x + y + z + sum_of_others):
        return f"{body_name} has a pose or velocity that is not finite"
    if z < -MAX_SUNK_DEPTH_M:
        return f"{body_name} is below the floor, at z = {z:.2f} m"
    return f"{body_name} has left the world, to ({x:.4g}, {y:.4g}, {z:.4g})"
