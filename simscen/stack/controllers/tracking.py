"""Where the robot is on its path, and what lies ahead."""

import math

import numpy as np

from simscen.core.geometry import Pose2
from simscen.core.navigation import Path

SEARCH_AHEAD = 1.5
"""Metres of path beyond the last place that are searched for the nearest point, so that a path may cross itself."""


class PathTracker:
    """Follows the robot's progress along a path; the place only ever moves forward."""

    def __init__(self, path: Path) -> None:
        self.points = np.ascontiguousarray(path.points)
        steps = np.hypot(*np.diff(self.points[:, :2], axis=0).T) if len(self.points) > 1 else np.zeros(0)
        self.along = np.concatenate(([0.0], np.cumsum(steps)))
        self.index = 0

    @property
    def length(self) -> float:
        """Length of the path in metres."""
        return float(self.along[-1])

    def locate(self, pose: Pose2) -> None:
        """Move to the point of the path nearest to the robot."""
        end = int(np.searchsorted(self.along, self.along[self.index] + SEARCH_AHEAD, side="right"))
        ahead = self.points[self.index : end]
        square = (ahead[:, 0] - pose.x) ** 2 + (ahead[:, 1] - pose.y) ** 2
        self.index += int(square.argmin())

    def remaining(self) -> float:
        """Metres of path from the nearest point to the end."""
        return float(self.along[-1] - self.along[self.index])

    def carrot(self, pose: Pose2, distance: float) -> tuple[float, float]:
        """Where the path leaves the circle of `distance` around the robot; its end if it does not leave.

        Interpolated between points, so that the carrot glides (RPP's circleSegmentIntersection).
        """
        end = int(np.searchsorted(self.along, self.along[self.index] + 2 * distance + 0.5, side="right"))
        ahead = self.points[self.index : end]
        outside = np.hypot(ahead[:, 0] - pose.x, ahead[:, 1] - pose.y) >= distance
        first = int(outside.argmax())
        if not outside[first]:
            x, y, _ = ahead[-1].tolist()
            return x, y
        x, y, _ = ahead[first].tolist()
        if first == 0:
            return x, y
        ax, ay, _ = ahead[first - 1].tolist()
        return _leaving(ax - pose.x, ay - pose.y, x - pose.x, y - pose.y, distance, pose)


def _leaving(ax: float, ay: float, bx: float, by: float, radius: float, centre: Pose2) -> tuple[float, float]:
    """The point between a (inside) and b (outside) on the circle around the origin, moved to `centre`."""
    dx, dy = bx - ax, by - ay
    a, b, c = dx * dx + dy * dy, ax * dx + ay * dy, ax * ax + ay * ay - radius * radius
    t = (-b + math.sqrt(max(0.0, b * b - a * c))) / a if a > 0 else 1.0
    return centre.x + ax + t * dx, centre.y + ay + t * dy
