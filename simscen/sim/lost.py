"""What the engine has lost: fallen through the floor, hurled away, or nowhere at all."""

import math

SUNK = 0.2
"""m below the floor at which the center of a thing has fallen through it.

What lands sinks in by millimeters; a light thing that a scripted one presses down on is held up to 7 cm below.
"""
FAR = 1e5
"""m from the origin of the world at which nothing can be any more: worlds reach to 10 km."""


def lost(what: str, x: float, y: float, z: float, others: float) -> str | None:
    """Why something whose center is at a place in the world cannot be right, or None.

    `others` is the sum of more numbers that have to be finite, such as its velocity: one that is not leaves no sum
    that is.
    """
    if -SUNK <= z <= FAR and -FAR <= x <= FAR and -FAR <= y <= FAR and math.isfinite(others):
        return None
    if not math.isfinite(x + y + z + others):
        return f"{what} is nowhere: its pose is not finite"
    if z < -SUNK:
        return f"{what} is below the floor, at z = {z:.2f} m"
    return f"{what} has left the world, to ({x:.4g}, {y:.4g}, {z:.4g})"
