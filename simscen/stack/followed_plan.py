"""The plan that the robot follows, and its position on it."""

import math

import numpy as np

from simscen.core.geometry import Array, Pose2
from simscen.core.messages.navigation import Path
from simscen.stack.controllers.tracking import PathTracker
from simscen.stack.costmap.costmap import Costmap
from simscen.stack.footprint import distances
from simscen.stack.localizers.beams import Plane
from simscen.stack.protocols import CostmapView

WATCH_DISTANCE_M = 0.5
"""Changes of the costmap this close to the plan are compared with the plan, or closer if the robot is larger."""
WATCH_EVERY_POINTS = 4
"""Spacing, in points of the plan, of the places near which changes are looked for."""
UNLOCATED_M = 0.5
"""Distance that the robot may move before its position on the plan is determined even if it is not needed."""
MISSED_M, END_M = 0.2, 0.03
"""A car needs a new plan this far beside its plan, or this close to its end, because it cannot turn in place."""


class FollowedPlan:
    """A plan in the map frame and the position of the robot on it."""

    def __init__(self, path: Path, radius: float, costmap: CostmapView) -> None:
        """Follow a path with a robot of this inscribed `radius` in m."""
        self.path, self._radius = path, radius
        self._tracker = PathTracker(path)
        self._pose: Pose2 | None = None
        self._located = Pose2(*path.points[0].tolist())
        self._line: Plane = path.points[:, 0] + 1j * path.points[:, 1]
        self._watch_distance = max(radius, WATCH_DISTANCE_M) + WATCH_EVERY_POINTS * self._tracker.longest
        self._revision = costmap.revision
        self.see(costmap)

    def watch(self, costmap: Costmap) -> None:
        """Compare the plan with the costmap if that has changed near the rest of the plan."""
        ahead = self._line[self._track.index :: WATCH_EVERY_POINTS]
        if costmap.changed_near(self._revision, ahead, self._watch_distance):
            self.see(costmap.view)
        self._revision = costmap.revision

    def see(self, costmap: CostmapView) -> None:
        """Compare the plan with a costmap."""
        self._occupied = distances(costmap, self.path.points[:, :2]) <= np.float32(self._radius)

    def locate(self, pose: Pose2) -> None:
        """Set the pose of the robot. Its position on the plan is determined when it is needed."""
        self._pose, (x, y, _) = pose, self._located
        if self._tracker.has_cusps or abs(pose.x - x) + abs(pose.y - y) > UNLOCATED_M:
            self._update_tracker(pose)

    def _update_tracker(self, pose: Pose2) -> None:
        self._tracker.locate(pose)
        self._located, self._pose = pose, None

    @property
    def _track(self) -> PathTracker:
        """The tracker, updated to the last pose."""
        if self._pose is not None:
            self._update_tracker(self._pose)
        return self._tracker

    @property
    def ahead(self) -> Array:
        """The points (n, 3) ahead of the robot."""
        points: Array = self._track.points[self._track.index :]
        return points

    def places(self, every: int) -> list[complex]:
        """Return every n-th point ahead as x + iy."""
        return self._track.places(every)

    def missed(self, pose: Pose2) -> bool:
        """Return whether a car can no longer reach its goal on this plan."""
        x, y, _ = self._track.points[self._track.index].tolist()
        return math.hypot(pose.x - x, pose.y - y) > MISSED_M or self.remaining() < END_M

    def remaining(self) -> float:
        """Return the length of the plan ahead in m."""
        return self._track.remaining()

    def blocked(self) -> bool:
        """Return whether the robot does not fit at a point ahead.

        The first points are ignored as long as they are occupied: a robot that stands there has to get out.
        """
        occupied = self._occupied[self._track.index :: 2]
        if not occupied.any():
            return False
        out = int((~occupied).argmax())
        return bool(occupied[out:].any() or occupied.all())
