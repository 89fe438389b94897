"""Poses of objects on scripted paths, computed in one batch for many ticks."""

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property

import numpy as np

from simscen.core.geometry import Array, Pose3, Vector
from simscen.core.geometry.motion_paths import PathSampler, PathSegment
from simscen.core.geometry.shapes import MotionPath

_new_pose = tuple.__new__  # faster than the constructor of the class


class PredictedPoses:
    """Predicted poses of all objects in a range of ticks. The prediction assumes that only scripted paths move objects.

    `names` are the moving objects. `table` (ticks, names, 7) contains their poses as x, y, z and a quaternion.
    `all_objects` contains the current poses of all objects by name. Objects that are not in `names` stay there.
    """

    def __init__(self, ticks: range, names: tuple[str, ...], table: Array, all_objects: Mapping[str, Pose3]) -> None:
        self.ticks, self.names, self.table, self.all_objects = ticks, names, table, all_objects
        self.all_objects_move = len(names) == len(all_objects)
        """Whether no object is at rest."""

    def at(self, tick: int) -> "PosesAtTick | None":
        """Return the poses at a tick; None if it is not in `ticks`."""
        return PosesAtTick(self, self.ticks.index(tick)) if tick in self.ticks else None

    def farther_than(self, point: Vector, distance: float) -> set[str]:
        """Return the moving objects whose origin is more than `distance` m away from `point` at all ticks."""
        offsets = self.table[:, :, :3] - point
        nearest = (offsets * offsets).sum(axis=2).min(axis=0)
        return {
            name for name, is_far in zip(self.names, (nearest > distance * distance).tolist(), strict=True) if is_far
        }

    @cached_property
    def columns(self) -> dict[str, int]:
        """Index of each moving object in the second dimension of `table`."""
        return {name: column for column, name in enumerate(self.names)}

    @cached_property
    def all_moved(self) -> list[bool]:
        """For each of `ticks`, whether all objects have moved since the previous tick; False for the first tick."""
        moved = (self.table[1:] != self.table[:-1]).any(axis=2).all(axis=1)
        return [False, *(moved & self.all_objects_move).tolist()]


class PosesAtTick(Mapping[str, Pose3]):
    """Poses of all objects by name at one tick. `row` is the index of the tick in `predicted`."""

    __slots__ = ("predicted", "row")

    def __init__(self, predicted: PredictedPoses, row: int) -> None:
        self.predicted, self.row = predicted, row

    @property
    def table(self) -> Array:
        """Poses (names, 7) of the moving objects: x, y, z and a quaternion."""
        row: Array = self.predicted.table[self.row]
        return row

    def __getitem__(self, name: str) -> Pose3:
        predicted = self.predicted
        column = predicted.columns.get(name)
        return (
            predicted.all_objects[name]
            if column is None
            else _new_pose(Pose3, predicted.table[self.row, column].tolist())
        )

    def __iter__(self) -> Iterator[str]:
        return iter(self.predicted.all_objects)

    def __len__(self) -> int:
        return len(self.predicted.all_objects)


class BatchPathSampler:
    """Computes poses on many paths at many times at once. The results have the same bits as those of `PathSampler`."""

    def __init__(self, paths_and_heights: Sequence[tuple[MotionPath, float]]) -> None:
        """Prepare the segments of the paths. Each path is paired with its constant height in m."""
        self._samplers = [PathSampler(*pair) for pair in paths_and_heights]
        self._z = np.array([z for _, z in paths_and_heights])
        paths = [path for path, _ in paths_and_heights]
        self._start, self._phase, self._first, self._last = np.array(
            [(path.start, path.phase, path.times[0], path.times[-1]) for path in paths]
        ).T
        self._durations = self._last - self._first
        self._once = np.array([path.mode == "once" for path in paths]) | (self._durations <= 0)
        self._is_back_and_forth = np.array([path.mode == "back_and_forth" for path in paths])
        self._period = np.where(
            self._once, 1.0, np.where(self._is_back_and_forth, 2 * self._durations, self._durations)
        )
        segments = list[PathSegment]()  # of all paths
        self._first_segments = list[int]()
        """Index of the first segment of each path."""
        self._switch_times = list[tuple[int, Array]]()
        """Index, and times of the inner poses, of each path with several segments."""
        for column, path in enumerate(paths):
            self._first_segments.append(len(segments))
            segments += [PathSegment.of(path, k) for k in range(len(path.times) - 1)] or [_PLACEHOLDER]
            if path.ease != "linear":
                segments[self._first_segments[-1] :] = [_PLACEHOLDER]
            elif len(path.times) > 2:
                self._switch_times.append((column, np.array(path.times[1:-1])))
        self._segments = np.array(segments).T.copy()
        self._rotates = self._segments[7] != 0

    def at(self, seconds: Array) -> Array:
        """Return poses (n, m, 7) of the m paths at n times; `seconds` (n, m) are relative to the start of each path."""
        running = seconds - self._start
        local = self._phase + np.where(running > 0, running, 0.0)
        elapsed = local - self._first
        folded = np.fmod(elapsed, self._period)
        folded = np.where(self._is_back_and_forth & (folded > self._durations), 2 * self._durations - folded, folded)
        local = np.where(self._once | (elapsed <= 0), local, self._first + folded)
        local = np.minimum(np.maximum(local, self._first), self._last)
        segments = np.tile(self._first_segments, (len(local), 1))
        for column, times in self._switch_times:
            segments[:, column] += times.searchsorted(local[:, column], "right")
        begin, durations, x, y, _, dx, dy, _, qz, qw = self._segments[:, segments]
        part = np.where(durations > 0, (local - begin) / np.where(durations > 0, durations, 1.0), 1.0)
        poses = np.zeros((*local.shape, 7))
        poses[..., 0], poses[..., 1], poses[..., 2] = x + part * dx, y + part * dy, self._z
        poses[..., 5], poses[..., 6] = qz, qw
        # Rotations and easing are computed one by one, because the sine of numpy may differ in the last bit.
        for row, column in np.argwhere(self._rotates[segments]).tolist():
            poses[row, column] = self._samplers[column].at(float(seconds[row, column]))
        return poses


_PLACEHOLDER = PathSegment(0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0)
"""Replaces the segments of a path with easing. `turn` is not 0: poses on the path are computed one by one."""
