"""Detects pushable objects that are at rest, so that the engine can put them to sleep, and records their rest poses."""

import itertools
import math
from collections.abc import Iterable, Mapping

from simscen.core.geometry import Pose3
from simscen.sim.bullet import engine, pybullet

SAMPLE_PERIOD_TICKS = 6
"""Number of ticks between two samples of the speed of an object."""
SAMPLE_COUNT = 5
"""Number of samples at which an object must be slow."""


class RestDetector:
    """Finds the bodies that are at rest from samples of their speeds.

    A body is at rest if it is slow at every sample, unless its speed increases from each sample to the next.
    """

    def __init__(self, client: int, body_ids: Iterable[int]) -> None:
        self._client = client
        self._speeds: dict[int, list[float]] = {body_id: [] for body_id in body_ids}

    def sample(self) -> None:
        """Record the current speed of each body: the norm of its linear (m/s) and angular (rad/s) velocity."""
        for body_id, speeds in self._speeds.items():
            linear, angular = pybullet.getBaseVelocity(body_id, self._client)
            speeds.append(math.hypot(*linear, *angular))

    def resting_ids(self) -> set[int]:
        """Return the ids of the bodies at rest."""
        return {
            body_id
            for body_id, speeds in self._speeds.items()
            if max(speeds) ** 2 < engine.REST_SPEED_SQUARED_M2_S2
            and any(now <= before for before, now in itertools.pairwise(speeds))
        }


class RestPoses:
    """Rest poses of pushable objects: poses that an object had at two consecutive updates, or at the first update."""

    def __init__(self) -> None:
        self.poses: Mapping[str, Pose3] = {}
        """Last rest pose of each object by name."""
        self._last: Mapping[str, Pose3] | None = None

    def update(self, poses: Mapping[str, Pose3]) -> None:
        """Update the rest poses with the current poses of all pushable objects.

        An object that moves or is removed keeps its last rest pose.
        """
        before, self._last = poses if self._last is None else self._last, poses
        changed = {name: pose for name, pose in poses.items() if before.get(name) == pose != self.poses.get(name)}
        if changed:
            self.poses = {**self.poses, **changed}
