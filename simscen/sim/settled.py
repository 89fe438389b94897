"""What has come to rest before a run begins sleeps from its first tick on.

Bullet lets a body lie after two seconds at rest, in which a chair costs what a robot costs. A world settles before tick
0, so that it shows by then what rests: it is slow at every look, and not faster at each than at the one before, as what
begins to slide or to tip over is. What else there is of speed are contacts that are solved a little differently each
time.
"""

import itertools
import math
from collections.abc import Iterable

import pybullet

from simscen.sim import engine

EVERY = 6
"""Ticks from one look to the next: what is at the end of a swing is fast at another."""
LOOKS = 5
"""Looks at which something has to be slow."""


class Settling:
    """Looks at bodies while the world settles."""

    def __init__(self, client: int, bodies: Iterable[int]) -> None:
        self._client = client
        self._speeds: dict[int, list[float]] = {body: [] for body in bodies}

    def look(self) -> None:
        """See how fast they are now, in m/s and rad/s."""
        for body, speeds in self._speeds.items():
            linear, angular = pybullet.getBaseVelocity(body, self._client)
            speeds.append(math.hypot(*linear, *angular))

    def at_rest(self) -> set[int]:
        """Those that are."""
        return {body for body, speeds in self._speeds.items() if _rests(speeds)}


def _rests(speeds: list[float]) -> bool:
    slow = max(speeds) ** 2 < engine.AT_REST
    return slow and any(now <= before for before, now in itertools.pairwise(speeds))
