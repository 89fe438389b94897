"""Options of the axes of variations.

An option contains new values for one or several paths. The values are listed in a file or drawn at random.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, overload

from simscen.loading.variations.paths import Target
from simscen.loading.yaml.tree import MappingNode, Node, ScalarNode, node_at

if TYPE_CHECKING:  # most scenarios have no variations
    from simscen.model.variations import Sampled


@dataclass(frozen=True)
class Change:
    """New value of a target. `number` is the position of the value in the list of values of its path, from 1."""

    target: Target
    value: Node
    number: int


@dataclass(frozen=True)
class Option:
    """Changes that are made together. `name` is the name in the file; "" for none."""

    changes: tuple[Change, ...]
    name: str = ""


class RandomOptions(Sequence[Option]):
    """Options with random values, drawn on demand. Indices beyond the length are valid as well."""

    def __init__(self, sampled: "Sampled", distributions: MappingNode, targets: Sequence[Target]) -> None:
        """Draw from the distributions in `sampled`. `distributions` is the YAML tree of these distributions by path."""
        self._sampled, self._distributions, self._targets = sampled, distributions, targets

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
                Change(target, value_node(self._distributions.entries[target.path].value, value), index + 1)
                for target, value in drawn
            )
        )

    def __iter__(self) -> Iterator[Option]:
        return (self[index] for index in range(len(self)))


def value_node(distribution: Node, value: object) -> Node:
    """Return the YAML node of a value that was drawn from a distribution. `distribution` is its YAML tree.

    For a ChoiceIndex, it is the chosen item of the `choice`. For other values, it is a new node at the position of the
    distribution.
    """
    from simscen.loading.variations.sampling import ChoiceIndex

    if isinstance(value, ChoiceIndex):
        chosen = node_at(distribution, ("choice", value.number))
        assert chosen is not None
        return chosen
    assert isinstance(value, str | int | float)
    return ScalarNode(distribution.position, value)


def typical_options(axis: Sequence[Option]) -> Sequence[Option]:
    """Return options of an axis that together change all its targets: the first one if they are random, else all."""
    return axis[:1] if isinstance(axis, RandomOptions) else axis
