"""When a plan that is being followed should be replaced."""

import math

import numpy as np

from simscen.core.geometry import Array, Pose2
from simscen.core.messages.navigation import Path
from simscen.stack.controllers.tracking import PathTracker
from simscen.stack.costmap.costmap import Costmap
from simscen.stack.footprint import distances
from simscen.stack.localizers.beams import Plane
from simscen.stack.protocols import CostmapView

CLEARLY_SHORTER, AT_LEAST = 0.85, 0.5
"""Hysteresis: another way must be this much shorter (ratio, and metres) before the robot changes its mind."""


TIGHTER = 0.1
"""Metres of room that a plan may lose to what has been seen since, or to the drift of odometry, before it is looked
at again: two cells."""
ROOMY = 0.5
"""Metres from obstacles beyond which more room is no gain."""
SOON = 4.0
"""Metres of plan ahead whose room counts."""


UNSEEN = 0.5
"""Metres that the robot may come before its place on the plan is looked for though nobody has asked for it."""
EVERY = 4
"""Of the plan's points that are asked whether something has changed near them."""
STRAYED, AT_END = 0.2, 0.03
"""Metres beside its plan, or from its end, at which a car needs another: it cannot turn back on the spot."""


class FollowedPlan:
    """The plan being followed, and how far the robot has come on it."""

    def __init__(self, path: Path, radius: float, costmap: CostmapView) -> None:
        self.path, self._radius = path, radius
        self._followed = PathTracker(path)
        self._pose: Pose2 | None = None
        self._located = Pose2(*path.points[0].tolist())
        self._line: Plane = path.points[:, 0] + 1j * path.points[:, 1]
        self._near = max(radius, ROOMY) + EVERY * self._followed.longest
        self._room = np.minimum(distances(costmap, path.points[:, :2]), np.float32(ROOMY))
        self._revision = costmap.revision
        self.see(costmap)

    def watch(self, costmap: Costmap) -> None:
        """See what the costmap shows now, where it may show another thing along the rest of the plan."""
        if costmap.changed_near(self._revision, self._line[self._track.index :: EVERY], self._near):
            self.see(costmap.view)
        self._revision = costmap.revision

    def see(self, costmap: CostmapView) -> None:
        """Compare the plan with a costmap."""
        room = distances(costmap, self.path.points[:, :2])
        self._bad = room <= np.float32(self._radius)
        self._tight = np.minimum(room, np.float32(ROOMY)) < self._room - np.float32(TIGHTER)

    def locate(self, pose: Pose2) -> None:
        """Note where the robot is. Its place on the plan is looked for when somebody asks, which mostly nobody does."""
        self._pose, (x, y, _) = pose, self._located
        if self._followed.has_cusps or abs(pose.x - x) + abs(pose.y - y) > UNSEEN:
            self._look(pose)

    def _look(self, pose: Pose2) -> None:
        self._followed.locate(pose)
        self._located, self._pose = pose, None

    @property
    def _track(self) -> PathTracker:
        """The plan, and where the robot is on it."""
        if self._pose is not None:
            self._look(self._pose)
        return self._followed

    @property
    def ahead(self) -> Array:
        """The points (n, 3) from where the robot is on."""
        points: Array = self._track.points[self._track.index :]
        return points

    def places(self, every: int) -> list[complex]:
        """So many apart of them as x + iy."""
        return self._track.places(every)

    def missed(self, pose: Pose2) -> bool:
        """Whether a car that has not reached its goal can no longer do so on this plan."""
        x, y, _ = self._track.points[self._track.index].tolist()
        return math.hypot(pose.x - x, pose.y - y) > STRAYED or self.remaining() < AT_END

    def remaining(self) -> float:
        """Metres to go."""
        return self._track.remaining()

    def blocked(self) -> bool:
        """Whether a point ahead has come to lie where the robot does not fit.

        The first points may be too near an obstacle already: a robot that stands there has to get out.
        """
        bad = self._bad[self._track.index :: 2]
        if not bad.any():
            return False
        out = int((~bad).argmax())
        return bool(bad[out:].any() or bad.all())

    def tightened(self) -> bool:
        """Whether the plan has clearly less room soon than it had when it was made.

        A plan made when an obstacle was half seen leads past it without room, though the robot would still fit.
        """
        track = self._track
        if not self._tight.any():
            return False
        along, index = track.along, track.index
        end = int(np.searchsorted(along, along[index] + SOON, side="right"))
        return bool(self._tight[index:end].any())

    def worse_than(self, length: float) -> bool:
        """Whether another plan, so many metres long, is clearly shorter than what is left of this one."""
        left = self.remaining()
        return length < CLEARLY_SHORTER * left and length < left - AT_LEAST
