"""Poses of scripted bodies at many times, computed in one batch."""

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property

import numpy as np

from simscen.core.geometry import Array, Pose3, Vector
from simscen.core.geometry.motion_paths import PathSampler, PathSegment
from simscen.core.geometry.shapes import MotionPath

_made = tuple.__new__  # a pose without the calls of its class


class PredictedPoses:
    """Things at `ticks`: those of `names` as in `table` (tick, thing, pose); of `everything`, by name, others stay."""

    def __init__(self, ticks: range, names: tuple[str, ...], table: Array, everything: Mapping[str, Pose3]) -> None:
        self.ticks, self.names, self.table, self.everything = ticks, names, table, everything
        self.complete = len(names) == len(everything)
        """Whether none stay."""

    def at(self, tick: int) -> "PosesAtTick | None":
        """Where everything is at a tick; None at any other."""
        return PosesAtTick(self, self.ticks.index(tick)) if tick in self.ticks else None

    def far(self, place: Vector, distance: float) -> set[str]:
        """Those in the table that are never within a distance in meters of a place."""
        ways = self.table[:, :, :3] - place
        nearest = (ways * ways).sum(axis=2).min(axis=0)
        return {name for name, far in zip(self.names, (nearest > distance * distance).tolist(), strict=True) if far}

    @cached_property
    def columns(self) -> dict[str, int]:
        """Where in the table those are that do not stay."""
        return {name: column for column, name in enumerate(self.names)}

    @cached_property
    def all_moved(self) -> list[bool]:
        """For each tick, whether everything is elsewhere than at the tick before."""
        moved = (self.table[1:] != self.table[:-1]).any(axis=2).all(axis=1)
        return [False, *(moved & self.complete).tolist()]


class PosesAtTick(Mapping[str, Pose3]):
    """Where everything is at one of those moments; a pose is made when somebody looks at it."""

    __slots__ = ("foreseen", "row")

    def __init__(self, foreseen: PredictedPoses, row: int) -> None:
        self.foreseen, self.row = foreseen, row

    @property
    def table(self) -> Array:
        """The poses (thing, pose) of those that do not stay."""
        row: Array = self.foreseen.table[self.row]
        return row

    def __getitem__(self, name: str) -> Pose3:
        seen = self.foreseen
        column = seen.columns.get(name)
        return seen.everything[name] if column is None else _made(Pose3, seen.table[self.row, column].tolist())

    def __iter__(self) -> Iterator[str]:
        return iter(self.foreseen.everything)

    def __len__(self) -> int:
        return len(self.foreseen.everything)


class BatchPathSampler:
    """Paths, each at a height z, asked at many times at once: `Track.at` to the last bit, by the same operations.

    Where something turns or is eased it is asked one time after the other: a sine of numpy's may differ in its last
    bit. Most are legs of one heading.
    """

    def __init__(self, each: Sequence[tuple[MotionPath, float]]) -> None:
        self._tracks = [PathSampler(*one) for one in each]
        self._z = np.array([z for _, z in each])
        paths = [path for path, _ in each]
        self._start, self._phase, self._first, self._last = np.array(
            [(path.start, path.phase, path.times[0], path.times[-1]) for path in paths]
        ).T
        self._lasts = self._last - self._first
        self._once = np.array([path.mode == "once" for path in paths]) | (self._lasts <= 0)
        self._returns = np.array([path.mode == "back_and_forth" for path in paths])
        self._period = np.where(self._once, 1.0, np.where(self._returns, 2 * self._lasts, self._lasts))
        # The legs of all paths, one behind the other; `inner` are the times at which those of several legs change them.
        legs, self._numbers, self._inner = list[PathSegment](), list[int](), list[tuple[int, Array]]()
        for column, path in enumerate(paths):
            self._numbers.append(len(legs))
            legs += [PathSegment.of(path, number) for number in range(len(path.times) - 1)] or [_UNEVEN]
            if path.ease != "linear":
                legs[self._numbers[-1] :] = [_UNEVEN]
            elif len(path.times) > 2:
                self._inner.append((column, np.array(path.times[1:-1])))
        self._legs = np.array(legs).T.copy()
        self._turns = self._legs[7] != 0

    def at(self, seconds: Array) -> Array:
        """Poses (n, m, 7) at times (n, m), each since its path was set off."""
        running = seconds - self._start
        local = self._phase + np.where(running > 0, running, 0.0)
        since = local - self._first
        into = np.fmod(since, self._period)
        into = np.where(self._returns & (into > self._lasts), 2 * self._lasts - into, into)
        local = np.where(self._once | (since <= 0), local, self._first + into)
        local = np.minimum(np.maximum(local, self._first), self._last)
        legs = np.tile(self._numbers, (len(local), 1))
        for column, times in self._inner:
            legs[:, column] += times.searchsorted(local[:, column], "right")
        begin, lasts, x, y, _, dx, dy, _, qz, qw = self._legs[:, legs]
        part = np.where(lasts > 0, (local - begin) / np.where(lasts > 0, lasts, 1.0), 1.0)
        poses = np.zeros((*local.shape, 7))
        poses[..., 0], poses[..., 1], poses[..., 2] = x + part * dx, y + part * dy, self._z
        poses[..., 5], poses[..., 6] = qz, qw
        for row, column in np.argwhere(self._turns[legs]).tolist():
            poses[row, column] = self._tracks[column].at(float(seconds[row, column]))
        return poses


_UNEVEN = PathSegment(0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 1.0)
"""Of what is asked one time after the other."""
