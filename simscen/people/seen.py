"""What people may see beside walls and each other, where it is at one moment."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from simscen.core.geometry import Array, Pose2


@dataclass(frozen=True, eq=False)
class SeenRobot:
    """A robot: its base's pose, velocity (m/s) in the world, radius (m), and outline (n, 2) in its own frame."""

    name: str
    pose: Pose2
    velocity: tuple[float, float]
    radius: float
    outline: Array


@dataclass(frozen=True, eq=False)
class SeenThing:
    """An object that is no person: its outlines (n, 2) in the world."""

    name: str
    outlines: tuple[Array, ...]


@dataclass(frozen=True, eq=False)
class Surroundings:
    """All robots and things, in the order of their names."""

    robots: tuple[SeenRobot, ...] = ()
    things: tuple[SeenThing, ...] = ()


def edges(outlines: Sequence[Array]) -> Array:
    """The sides of rings as segments (n, 2, 2)."""
    rings = [np.stack((ring, np.roll(ring, -1, axis=0)), axis=1) for ring in outlines]
    return np.concatenate(rings) if rings else np.empty((0, 2, 2))
