"""Options of an axis of variations: changes that belong together, listed in the file or drawn at random."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, overload

from simscen.loading.variations.paths import Target
from simscen.loading.yaml.tree import MappingNode, Node, ScalarNode, node_at

if TYPE_CHECKING:  # most scenarios have no variations
    from simscen.model.variations import Sampled


@dataclass(frozen=True)
class Change:
    """Value for a path; `number` counts the values of the path from 1."""

    target: Target
    value: Node
    number: int


@dataclass(frozen=True)
class Option:
    """Changes that belong together, and their name if the author gave one."""

    changes: tuple[Change, ...]
    name: str = ""


class RandomOptions(Sequence[Option]):
    """Options of `sampled` with random values, which are drawn on demand.

    The length is the `count`, but an index may exceed it.
    """

    def __init__(self, sampled: "Sampled", ranges: MappingNode, targets: Sequence[Target]) -> None:
        self._sampled, self._ranges, self._targets = sampled, ranges, targets

    def __len__(self) -> int:
        return self._sampled.count

    @overload
    def __getitem__(self, index: int) -> Option: ...
    @overload
    def __getitem__(self, index: slice) -> list[Option]: ...
    def __getitem__(self, index: int | slice) -> Option | list[Option]:
        if isinstance(index, slice):
            return [self[i] for i in range(*index.indices(len(self)))]
        from simscen.loading.variations.sampling import draw_value

        drawn = [(target, draw_value(self._sampled, target.path, index)) for target in self._targets]
        return Option(
            tuple(
                Change(target, value_node(self._ranges.entries[target.path].value, value), index + 1)
                for target, value in drawn
            )
        )

    def __iter__(self) -> Iterator[Option]:
        return (self[index] for index in range(len(self)))


def value_node(distribution: Node, value: object) -> Node:
    """Return the node of a drawn value: one of the choices, or a new node at the position of its distribution."""
    from simscen.loading.variations.sampling import ChoiceIndex

    if isinstance(value, ChoiceIndex):
        chosen = node_at(distribution, ("choice", value.number))
        assert chosen is not None
        return chosen
    assert isinstance(value, str | int | float)
    return ScalarNode(distribution.position, value)


def typical_options(axis: Sequence[Option]) -> Sequence[Option]:
    """Return options with all targets of the axis: all, or the first one of random options."""
    return axis[:1] if isinstance(axis, RandomOptions) else axis
