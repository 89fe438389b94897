"""Path handler: tracks the position of the robot on its path, and returns the part of the path ahead."""

import math
from bisect import bisect_left, bisect_right
from cmath import phase
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np

from simscen.core.geometry import Array, Pose2
from simscen.core.messages.navigation import Path
from simscen.stack.kinematics import direction_changes, forward_steps

SEARCH_AHEAD_M = 1.5
"""Default length of path beyond the last position that is searched for the nearest point."""
CUSP_REACHED_M = 0.03
"""Length of path to a cusp below which the cusp counts as reached."""
CURVATURE_SPAN_M = 0.3
"""Length of path to both sides of a point over which the curvature is measured."""
CARROT_SEARCH_MARGIN_M = 0.5
"""Length of path, in addition to twice the lookahead distance, that is searched for the carrot."""
LENGTH_TOLERANCE_M = 1e-9
"""Rounding error allowed for sums of lengths."""

Extension = Literal["none", "path", "heading"]


class PathTracker:
    """A path and the position of the robot on it. The position only moves toward the end of the path.

    Cusps (changes of the driving direction) divide the path into segments. Points beyond the next cusp are ignored
    until the robot has reached the cusp.
    """

    def __init__(self, path: Path, search_distance: float = SEARCH_AHEAD_M) -> None:
        """Take a path. `search_distance` is the length of path in m that is searched beyond the last position."""
        self._search_distance = search_distance
        self.points = np.ascontiguousarray(path.points)
        steps = np.diff(self.points[:, :2], axis=0)
        lengths = np.hypot(steps[:, 0], steps[:, 1])
        self.path_lengths = np.concatenate(([0.0], np.cumsum(lengths)))
        """Lengths (n,) in m of the path from the start to each point."""
        self._path_lengths: list[float] = self.path_lengths.tolist()
        self._complex_points: list[complex] = (self.points[:, 0] + 1j * self.points[:, 1]).tolist()
        self.longest_step = float(lengths.max(initial=0.0))
        """Maximum distance in m between successive points."""
        self._points_per_meter = 1.0 / (self.longest_step + LENGTH_TOLERANCE_M)
        is_forward = forward_steps(self.points)
        self._segment_ends: list[int] = [*direction_changes(is_forward).tolist(), len(self.points) - 1]
        self._segment_forward: list[bool] = [
            bool(is_forward[max(0, end - 1)]) if len(is_forward) else True for end in self._segment_ends
        ]
        self.index = self._segment_start = 0
        """Indices of the point at the position of the robot, and of the start of the current segment."""

    @property
    def length(self) -> float:
        """Length of the path in m."""
        return self._path_lengths[-1]

    @property
    def has_cusps(self) -> bool:
        """Whether there is a cusp ahead."""
        return len(self._segment_ends) > 1

    @property
    def is_forward(self) -> bool:
        """Whether the current segment is driven forward."""
        return self._segment_forward[0]

    def locate(self, pose: Pose2) -> None:
        """Update the position: the nearest point of the current segment or, at a cusp, of the next segment."""
        self._find_nearest(pose)
        while len(self._segment_ends) > 1 and self.remaining_in_segment() <= CUSP_REACHED_M:
            self.index = self._segment_start = self._segment_ends.pop(0)
            self._segment_forward.pop(0)
            self._find_nearest(pose)

    def _find_nearest(self, pose: Pose2) -> None:
        """Move the position to the nearest point ahead in the current segment, within the search distance."""
        points, along, robot = self._complex_points, self._path_lengths, complex(pose.x, pose.y)
        index = nearest = self.index
        end, search_end, shortest = self._segment_ends[0], along[index] + self._search_distance, math.inf
        while index <= end and along[index] <= search_end:
            distance = abs(points[index] - robot)
            if distance < shortest:
                nearest, shortest = index, distance
            index += int((distance - shortest) * self._points_per_meter) or 1
        self.index = nearest

    def ahead(self, length: float) -> tuple[Array, Array]:
        """Return the next points (n, 3) of the segment, and path lengths (n,) in m from the first point to each.

        The last point is the first one beyond `length` m, or the end of the segment. At the end of the segment, return
        the last two points.
        """
        end = bisect_right(self._path_lengths, self._path_lengths[self.index] + length)
        end = min(end + 1, self._segment_ends[0] + 1)
        start = min(self.index, max(0, end - 2))
        return self.points[start:end], self.path_lengths[start:end] - self.path_lengths[start]

    def sampled_points(self, every: int) -> list[complex]:
        """Return every n-th point (x + iy) from the position to the end of the path, even beyond cusps."""
        return self._complex_points[self.index :: every]

    def samples_ahead(self, spacing: float, reach: float) -> Iterator[tuple[float, complex, float]]:
        """Yield (path length in m, x + iy, curvature in 1/m) for points of the segment, about `spacing` m apart.

        The first point is about `spacing` m ahead of the position, the last point about `reach` m ahead.
        """
        along, start = self._path_lengths, self._path_lengths[self.index]
        length = spacing
        while length <= reach:
            index = bisect_left(along, start + length)
            if index > self._segment_ends[0]:
                return
            yield along[index] - start, self._complex_points[index], self._curvature(index)
            length = along[index] - start + spacing

    def _curvature(self, index: int) -> float:
        """Return the approximate absolute curvature at a point in 1/m; 0 near the ends of the segment."""
        along, points = self._path_lengths, self._complex_points
        before = bisect_right(along, along[index] - CURVATURE_SPAN_M) - 1
        after = bisect_left(along, along[index] + CURVATURE_SPAN_M)
        if before < self._segment_start or after > self._segment_ends[0]:
            return 0.0
        turn = phase((points[after] - points[index]) * (points[index] - points[before]).conjugate())
        return 2.0 * abs(turn) / (along[after] - along[before])

    def remaining(self) -> float:
        """Return the remaining length of the path in m."""
        return self._path_lengths[-1] - self._path_lengths[self.index]

    def remaining_in_segment(self) -> float:
        """Return the remaining length of the segment in m."""
        return self._path_lengths[self._segment_ends[0]] - self._path_lengths[self.index]

    @property
    def segment_end(self) -> tuple[float, float]:
        """Position (x, y) of the end of the segment."""
        end = self._complex_points[self._segment_ends[0]]
        return end.real, end.imag

    def carrot(self, pose: Pose2, distance: float, extension: Extension = "none") -> tuple[float, float]:
        """Return the carrot (x, y): the point at which the segment leaves a circle around the robot.

        `distance` is the radius of the circle in m. If the searched part of the segment ends inside the circle, the
        carrot is its end. With an `extension`, a straight line extends this end, and the carrot is the point at which
        the line leaves the circle. The direction of the line is the direction of the last two points (`path`, as RPP's
        interpolate_curvature_after_goal), or the driving direction of the last pose (`heading`).
        """
        search_end = self._path_lengths[self.index] + 2 * distance + CARROT_SEARCH_MARGIN_M
        outside = self._first_outside(pose, distance, search_end)
        if outside is None:
            end = min(bisect_right(self._path_lengths, search_end), self._segment_ends[0])
            x, y = self.points[end, :2].tolist()
            if extension == "none":
                return x, y
            dx, dy = self._heading(end) if extension == "heading" else self._path_direction(end)
            extended_x, extended_y = x + 2 * distance * dx, y + 2 * distance * dy
            return _on_circle(x - pose.x, y - pose.y, extended_x - pose.x, extended_y - pose.y, distance, pose)
        point = self._complex_points[outside]
        if outside == self.index:
            return point.real, point.imag
        inside = self._complex_points[outside - 1]
        return _on_circle(
            inside.real - pose.x, inside.imag - pose.y, point.real - pose.x, point.imag - pose.y, distance, pose
        )

    def _heading(self, index: int) -> tuple[float, float]:
        """Return the driving direction of the pose `index` as a unit vector."""
        yaw, sign = float(self.points[index, 2]), 1.0 if self.is_forward else -1.0
        return sign * math.cos(yaw), sign * math.sin(yaw)

    def _path_direction(self, index: int) -> tuple[float, float]:
        """Return the direction from the previous point to the point `index` as a unit vector.

        Previous points at the same position are skipped. If there is no other point in the segment, return the heading.
        """
        before = bisect_left(self._path_lengths, self._path_lengths[index] - LENGTH_TOLERANCE_M) - 1
        if before < self._segment_start:
            return self._heading(index)
        step = self._complex_points[index] - self._complex_points[before]
        return step.real / abs(step), step.imag / abs(step)

    def _first_outside(self, pose: Pose2, distance: float, search_end: float) -> int | None:
        """Return the index of the first point ahead that is at least `distance` m from the robot, or None.

        The search ends at the path length `search_end` in m, or at the end of the segment.
        """
        points, along, robot = self._complex_points, self._path_lengths, complex(pose.x, pose.y)
        index, end = self.index, self._segment_ends[0]
        while index <= end and (index == 0 or along[index - 1] <= search_end):
            point_distance = abs(points[index] - robot)
            if point_distance >= distance:
                return index
            # Skip points that are certainly inside the circle.
            index += int((distance - point_distance) * self._points_per_meter) or 1
        return None


def _on_circle(ax: float, ay: float, bx: float, by: float, radius: float, center: Pose2) -> tuple[float, float]:
    """Return the point (x, y) at which the line from a, inside a circle, to b leaves the circle.

    a and b are relative to the `center` of the circle.
    """
    dx, dy = bx - ax, by - ay
    a, b, c = dx * dx + dy * dy, ax * dx + ay * dy, ax * ax + ay * ay - radius * radius
    t = (-b + math.sqrt(max(0.0, b * b - a * c))) / a if a > 0 else 1.0
    return center.x + ax + t * dx, center.y + ay + t * dy


PATH_SPACING_M = 0.05
"""Default distance between the points of an upcoming path."""


@dataclass(frozen=True, eq=False)
class UpcomingPath:
    """Part of the path ahead of the robot, at most up to the next cusp.

    points:   poses (n, 3) at equal distances
    spacing:  path length in m between two successive points
    length:   path length in m from the first to the last point
    """

    points: Array
    spacing: float
    length: float


def upcoming_path(tracker: PathTracker, max_length: float, spacing: float = PATH_SPACING_M) -> UpcomingPath:
    """Return the next `max_length` m of the path with points at most `spacing` m apart."""
    points, along = tracker.ahead(max_length)
    length = float(min(max_length, along[-1]))
    steps = max(1, math.ceil(length / spacing - LENGTH_TOLERANCE_M))
    lengths = np.arange(steps + 1) * (length / steps)
    lengths[-1] = length
    x, y = np.interp(lengths, along, points[:, 0]), np.interp(lengths, along, points[:, 1])
    yaw = points[np.minimum(np.searchsorted(along, lengths + LENGTH_TOLERANCE_M, side="right"), len(points)) - 1, 2]
    return UpcomingPath(np.stack((x, y, yaw), axis=-1), length / steps, length)
