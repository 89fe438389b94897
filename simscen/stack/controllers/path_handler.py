"""Path handler: the progress of the robot along its path, and the part of the path that lies ahead."""

import math
from bisect import bisect_left, bisect_right
from cmath import phase
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose2
from simscen.core.messages.navigation import Path
from simscen.stack.cusps import changes, forward_steps

SEARCH_AHEAD_M = 1.5
"""Length of path beyond the last position that is searched for the nearest point, so that a path may cross itself."""
CUSP_REACHED_M = 0.03
"""Distance to a change of direction at which it counts as reached."""
CURVATURE_SPAN_M = 0.3
"""Distance to both sides of a point over which the curvature of the path is measured."""
LENGTH_TOLERANCE_M = 1e-9
"""Rounding error allowed for sums of lengths."""


class PathTracker:
    """Follows the robot's progress along a path; the place only ever moves forward.

    A path may change between forward and backward (Reeds-Shepp). It is followed piece by piece: nothing beyond the
    next such cusp is looked at until the robot is there.

    Searches pass over what cannot be what they look for: so many meters along the path change the distance to the robot
    by no more than that, and so many points are no more meters than that many of the longest steps. A handful of points
    x + iy is looked at, which takes less than arrays of thirty do.
    """

    def __init__(self, path: Path) -> None:
        self.points = np.ascontiguousarray(path.points)
        steps = np.diff(self.points[:, :2], axis=0)
        lengths = np.hypot(steps[:, 0], steps[:, 1])
        self.along = np.concatenate(([0.0], np.cumsum(lengths)))
        self._meters: list[float] = self.along.tolist()
        self._places: list[complex] = (self.points[:, 0] + 1j * self.points[:, 1]).tolist()
        self.longest = float(lengths.max(initial=0.0))
        """Length of the longest step in m."""
        self._most = 1.0 / (self.longest + LENGTH_TOLERANCE_M)
        """Points for each meter, at least."""
        ahead = forward_steps(self.points)
        self._ends: list[int] = [*changes(ahead).tolist(), len(self.points) - 1]
        self._forward: list[bool] = [bool(ahead[max(0, end - 1)]) if len(ahead) else True for end in self._ends]
        self.index = self._begin = 0

    @property
    def length(self) -> float:
        """Length of the path in meters."""
        return self._meters[-1]

    @property
    def has_cusps(self) -> bool:
        """Whether the path has another piece after this one."""
        return len(self._ends) > 1

    @property
    def forward(self) -> bool:
        """Whether the piece being followed is driven forward."""
        return self._forward[0]

    def locate(self, pose: Pose2) -> None:
        """Move to the point of this piece nearest to the robot, and on to the next piece at its end."""
        self._nearest(pose)
        while len(self._ends) > 1 and self.to_cusp() <= CUSP_REACHED_M:
            self.index = self._begin = self._ends.pop(0)
            self._forward.pop(0)
            self._nearest(pose)

    def _nearest(self, pose: Pose2) -> None:
        places, meters, most, here = self._places, self._meters, self._most, complex(pose.x, pose.y)
        index = nearest = self.index
        end, far, near = self._ends[0], meters[index] + SEARCH_AHEAD_M, math.inf
        while index <= end and meters[index] <= far:
            away = abs(places[index] - here)
            if away < near:
                nearest, near = index, away
            index += int((away - near) * most) or 1
        self.index = nearest

    def ahead(self, meters: float) -> tuple[Array, Array]:
        """Points (n, 3) of this piece for so many meters, at least two where it has any, and meters (n,) to them."""
        end = min(self._stop(meters) + 1, self._ends[0] + 1)
        start = min(self.index, max(0, end - 2))
        return self.points[start:end], self.along[start:end] - self.along[start]

    def places(self, every: int) -> list[complex]:
        """Each so-manieth of the points from the nearest one on, x + iy."""
        return self._places[self.index :: every]

    def stations(self, step: float, reach: float) -> Iterator[tuple[float, complex, float]]:
        """Points of this piece about `step` meters apart, the first so far ahead: meters to each, x + iy, its bend."""
        meters, here = self._meters, self._meters[self.index]
        at = step
        while at <= reach:
            index = bisect_left(meters, here + at)
            if index > self._ends[0]:
                return
            yield meters[index] - here, self._places[index], self._bend(index)
            at = meters[index] - here + step

    def _bend(self, index: int) -> float:
        """About the curvature at a point in 1/m; 0 where the piece does not go on so far to both sides."""
        meters, places = self._meters, self._places
        before = bisect_right(meters, meters[index] - CURVATURE_SPAN_M) - 1
        after = bisect_left(meters, meters[index] + CURVATURE_SPAN_M)
        if before < self._begin or after > self._ends[0]:
            return 0.0
        turn = phase((places[after] - places[index]) * (places[index] - places[before]).conjugate())
        return 2.0 * abs(turn) / (meters[after] - meters[before])

    def remaining(self) -> float:
        """Return the length of path from the nearest point to the end, in m."""
        return self._meters[-1] - self._meters[self.index]

    def to_cusp(self) -> float:
        """Return the length of path to the end of this piece, in m."""
        return self._meters[self._ends[0]] - self._meters[self.index]

    @property
    def piece_end(self) -> tuple[float, float]:
        """End point of this piece."""
        end = self._places[self._ends[0]]
        return end.real, end.imag

    def carrot(self, pose: Pose2, distance: float, beyond: bool = False) -> tuple[float, float]:
        """Return where the piece leaves the circle of `distance` around the robot, or its end if it does not.

        Interpolated between points, so that the carrot glides (RPP's circleSegmentIntersection). `beyond` prolongs
        the piece in the direction it ends in, so that the robot comes in straight (interpolate_curvature_after_goal).
        """
        far = self._meters[self.index] + 2 * distance + 0.5
        first = self._leaving(pose, distance, far)
        if first is None:
            x, y, yaw = self.points[min(bisect_right(self._meters, far), self._ends[0])].tolist()
            if not beyond:
                return x, y
            more = distance if self.forward else -distance
            return _on_circle(
                x - pose.x, y - pose.y, x + 2 * more * math.cos(yaw) - pose.x, y + 2 * more * math.sin(yaw) - pose.y,
                distance, pose,
            )  # fmt: skip
        x, y = (place := self._places[first]).real, place.imag
        if first == self.index:
            return x, y
        before = self._places[first - 1]
        return _on_circle(before.real - pose.x, before.imag - pose.y, x - pose.x, y - pose.y, distance, pose)

    def _leaving(self, pose: Pose2, distance: float, far: float) -> int | None:
        """Return the first point of the piece, at most `far` m along the path, that is at least `distance` m away."""
        places, meters, most, here = self._places, self._meters, self._most, complex(pose.x, pose.y)
        index, end = self.index, self._ends[0]
        while index <= end and (index == 0 or meters[index - 1] <= far):
            near = abs(places[index] - here)
            if near >= distance:
                return index
            index += int((distance - near) * most) or 1
        return None

    def _stop(self, meters: float) -> int:
        """One past the last point so far ahead, or of this piece."""
        end = bisect_right(self._meters, self._meters[self.index] + meters)
        return min(end, self._ends[0] + 1)


def _on_circle(ax: float, ay: float, bx: float, by: float, radius: float, center: Pose2) -> tuple[float, float]:
    """Return the intersection of segment a (inside) to b (outside) with a circle, in the frame of `center`."""
    dx, dy = bx - ax, by - ay
    a, b, c = dx * dx + dy * dy, ax * dx + ay * dy, ax * ax + ay * ay - radius * radius
    t = (-b + math.sqrt(max(0.0, b * b - a * c))) / a if a > 0 else 1.0
    return center.x + ax + t * dx, center.y + ay + t * dy


Floats = npt.NDArray[np.float32]
LOCAL_PLAN_SPACING_M = 0.05
"""Distance between points: Nav2's planners return one per costmap cell, and its critics count points."""


@dataclass(frozen=True, eq=False)
class LocalPlan:
    """Poses (n, 3) from where the robot is on its path, `spacing` meters apart, and its `length`.

    It ends where the robot must next turn round, at the path's end, or after as many meters as were asked for.
    """

    points: Array
    spacing: float
    length: float

    def about(self, pose: Pose2) -> tuple[Floats, Floats, Floats]:
        """x, y (n,) with the robot at the origin of the unrotated frame, and yaw: short numbers for float32."""
        x, y, yaw = self.points.T
        return (x - pose.x).astype(np.float32), (y - pose.y).astype(np.float32), yaw.astype(np.float32)


def local_plan(track: PathTracker, meters: float, spacing: float = LOCAL_PLAN_SPACING_M) -> LocalPlan:
    """Return the next `meters` of the path with points at most `spacing` m apart."""
    points, along = track.ahead(meters)
    length = float(min(meters, along[-1]))
    steps = max(1, math.ceil(length / spacing - 1e-9))
    at = np.arange(steps + 1) * (length / steps)
    at[-1] = length
    x, y = np.interp(at, along, points[:, 0]), np.interp(at, along, points[:, 1])
    yaw = points[np.minimum(np.searchsorted(along, at + 1e-9, side="right"), len(points)) - 1, 2]
    return LocalPlan(np.stack((x, y, yaw), axis=-1), length / steps, length)
