"""Detects objects at rest, so that they can sleep from the first tick, and records where they rest.

Bullet deactivates a body after two seconds at rest; until then, a chair takes as much computing time as a robot. The
world settles before tick 0, and the speed of each object is sampled meanwhile. An object is at rest if it is slow at
every sample and its speed does not increase from each sample to the next. A speed that increases every time shows that
the object begins to slide or tip over; other small speeds are jitter of the contact solver.
"""

import itertools
import math
from collections.abc import Iterable, Mapping

import pybullet

from simscen.core.geometry import Pose3
from simscen.sim.bullet import engine

SAMPLE_PERIOD_TICKS = 6
"""Ticks between two samples. A swinging object is slow at one sample and fast at another."""
SAMPLE_COUNT = 5
"""Number of samples at which an object must be slow."""


class RestDetector:
    """Samples the speeds of bodies while the world settles."""

    def __init__(self, client: int, body_ids: Iterable[int]) -> None:
        self._client = client
        self._speeds: dict[int, list[float]] = {body_id: [] for body_id in body_ids}

    def sample(self) -> None:
        """Record the current speed of each body (norm of m/s and rad/s)."""
        for body_id, speeds in self._speeds.items():
            linear, angular = pybullet.getBaseVelocity(body_id, self._client)
            speeds.append(math.hypot(*linear, *angular))

    def resting_ids(self) -> set[int]:
        """Return the ids of the bodies at rest."""
        return {body_id for body_id, speeds in self._speeds.items() if _is_at_rest(speeds)}


def _is_at_rest(speeds: list[float]) -> bool:
    is_slow = max(speeds) ** 2 < engine.REST_SPEED_SQUARED
    return is_slow and any(now <= before for before, now in itertools.pairwise(speeds))


class RestPoses:
    """Rest poses of pushable objects, by name.

    A rest pose is a pose that an object had at two consecutive updates. All poses of the first update are rest poses.
    """

    def __init__(self) -> None:
        self.poses: Mapping[str, Pose3] = {}
        """Newest rest pose of each object. A change of a pose creates a new mapping."""
        self._last: Mapping[str, Pose3] | None = None

    def update(self, poses: Mapping[str, Pose3]) -> None:
        """Update the rest poses with the current poses of all pushable objects.

        The last rest pose of an object that moves or is removed stays, in case it returns to exactly this pose.
        """
        before, self._last = poses if self._last is None else self._last, poses
        changed = {name: pose for name, pose in poses.items() if before.get(name) == pose != self.poses.get(name)}
        if changed:
            self.poses = {**self.poses, **changed}
