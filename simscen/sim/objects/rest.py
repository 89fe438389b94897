"""What has come to rest before a run begins sleeps from its first tick on.

Bullet lets a body lie after two seconds at rest, in which a chair costs what a robot costs. A world settles before tick
0, so that it shows by then what rests: it is slow at every look, and not faster at each than at the one before, as what
begins to slide or to tip over is. What else there is of speed are contacts that are solved a little differently each
time.
"""

import itertools
import math
from collections.abc import Iterable, Mapping

import pybullet

from simscen.core.geometry import Pose3
from simscen.sim.bullet import engine

SAMPLE_PERIOD_TICKS = 6
"""Ticks from one look to the next: what is at the end of a swing is fast at another."""
SAMPLE_COUNT = 5
"""Looks at which something has to be slow."""


class RestDetector:
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


# Rest poses of movable objects.
class RestPoses:
    """By name, the `poses` in which things lay at two looks in a row, or at the first."""

    def __init__(self) -> None:
        self.poses: Mapping[str, Pose3] = {}
        """Another mapping whenever one of them is another."""
        self._lay: Mapping[str, Pose3] | None = None

    def look(self, lie: Mapping[str, Pose3]) -> None:
        """See how everything lies that can be pushed.

        What has left its home, or is gone, keeps it for when it is there again to the last bit.
        """
        before, self._lay = lie if self._lay is None else self._lay, lie
        come = {name: pose for name, pose in lie.items() if before.get(name) == pose != self.poses.get(name)}
        if come:
            self.poses = {**self.poses, **come}
