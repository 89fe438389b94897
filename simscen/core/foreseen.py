"""Where scripts have things at moments that are yet to come, worked out for many of them at once."""

from collections.abc import Iterator, Mapping
from functools import cached_property

from simscen.core.geometry import Array, Pose3

_made = tuple.__new__  # a pose without the calls of its class


class Foreseen:
    """Things at `ticks`: those of `names` as in `table` (tick, thing, pose); of `everything`, by name, others stay."""

    def __init__(self, ticks: range, names: tuple[str, ...], table: Array, everything: Mapping[str, Pose3]) -> None:
        self.ticks, self.names, self.table, self.everything = ticks, names, table, everything
        self.complete = len(names) == len(everything)
        """Whether none stay."""

    def at(self, tick: int) -> "Places | None":
        """Where everything is at a tick; None at any other."""
        return Places(self, self.ticks.index(tick)) if tick in self.ticks else None

    @cached_property
    def all_moved(self) -> list[bool]:
        """For each tick, whether everything is elsewhere than at the tick before."""
        moved = (self.table[1:] != self.table[:-1]).any(axis=2).all(axis=1)
        return [False, *(moved & self.complete).tolist()]


class Places(Mapping[str, Pose3]):
    """Where everything is at one of those moments; poses are made when somebody looks at one."""

    __slots__ = ("_poses", "foreseen", "row")

    def __init__(self, foreseen: Foreseen, row: int) -> None:
        self.foreseen, self.row = foreseen, row
        self._poses: dict[str, Pose3] | None = None

    @property
    def table(self) -> Array:
        """The poses (thing, pose) of those that do not stay."""
        row: Array = self.foreseen.table[self.row]
        return row

    @property
    def poses(self) -> dict[str, Pose3]:
        """By name, in order."""
        poses = self._poses
        if poses is None:
            seen = self.foreseen
            poses = self._poses = {**seen.everything}
            for name, row in zip(seen.names, self.table.tolist(), strict=True):
                poses[name] = _made(Pose3, row)
        return poses

    def __getitem__(self, name: str) -> Pose3:
        return self.poses[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.foreseen.everything)

    def __len__(self) -> int:
        return len(self.foreseen.everything)
