"""Where scripts have things at moments that are yet to come, worked out for many of them at once."""

from collections.abc import Iterator, Mapping
from functools import cached_property

from simscen.core.geometry import Array, Pose3, Vector

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

    def far(self, place: Vector, distance: float) -> set[str]:
        """Those in the table that are never within a distance in metres of a place."""
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


class Places(Mapping[str, Pose3]):
    """Where everything is at one of those moments; a pose is made when somebody looks at it."""

    __slots__ = ("foreseen", "row")

    def __init__(self, foreseen: Foreseen, row: int) -> None:
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
