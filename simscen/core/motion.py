"""Velocities, and what a robot is told to do with them."""

from typing import NamedTuple


class Twist(NamedTuple):
    """A velocity of the robot's base in its own frame: m/s forward, m/s to the left, rad/s anticlockwise."""

    vx: float = 0.0
    vy: float = 0.0
    wz: float = 0.0


STOP = Twist()
