"""What the engine has lost: fallen through the floor, hurled away, or nowhere at all."""

import math

MAX_SUNK_DEPTH_M = 0.2
"""m below the floor at which the center of a thing has fallen through it.

What lands sinks in by millimeters; a light thing that a scripted one presses down on is held up to 7 cm below.
"""
MAX_COORDINATE_M = 1e5
"""m from the origin of the world at which nothing can be any more: worlds reach to 10 km."""


def divergence_reason(what: str, x: float, y: float, z: float, others: float) -> str | None:
    """Why something whose center is at a place in the world cannot be right, or None.

    `others` is the sum of more numbers that have to be finite, such as its velocity: one that is not leaves no sum
    that is.
    """
    if (
        -MAX_SUNK_DEPTH_M <= z <= MAX_COORDINATE_M
        and -MAX_COORDINATE_M <= x <= MAX_COORDINATE_M
        and -MAX_COORDINATE_M <= y <= MAX_COORDINATE_M
        and math.isfinite(others)
    ):
        return None
    if not math.isfinite(x + y + z + others):
        return f"{what} is nowhere: its pose is not finite"
    if z < -MAX_SUNK_DEPTH_M:
        return f"{what} is below the floor, at z = {z:.2f} m"
    return f"{what} has left the world, to ({x:.4g}, {y:.4g}, {z:.4g})"
