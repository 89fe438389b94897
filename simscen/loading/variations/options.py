"""Options of the axes of variations: new values for one or several paths, listed in a file or drawn at random."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

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


class RandomOptions:
    """Sequence of options with random values, drawn on demand. Indices beyond the length are valid as well."""

    def __init__(self, sampled: "Sampled", distributions: MappingNode, targets: Sequence[Target]) -> None:
        """Draw from the distributions in `sampled`. `distributions` is the YAML tree of these distributions by path."""
        self._sampled, self._distributions, self._targets = sampled, distributions, targets

    def __len__(self) -> int:
        return self._sampled.count

    def __getitem__(self, index: int) -> Option:
        from simscen.loading.variations.sampling import draw_value

        changes = []
        for target in self._targets:
            value = draw_value(self._sampled, target.path, index)
            node = value_node(self._distributions.entries[target.path].value, value)
            changes.append(Change(target, node, index + 1))
        return Option(tuple(changes))


Axis = Sequence[Option] | RandomOptions
"""Options of which each variation uses one."""


def value_node(distribution: Node, value: object) -> Node:
    """Return the node of a value drawn from `distribution` (YAML): an item of its `choice`, or a new node."""
    from simscen.loading.variations.sampling import ChoiceIndex

    if isinstance(value, ChoiceIndex):
        chosen = node_at(distribution, ("choice", value.number))
        assert chosen is not None
        return chosen
    assert isinstance(value, str | int | float)
    return ScalarNode(distribution.position, value)


def typical_options(axis: Axis) -> Sequence[Option]:
    """Return options of an axis that together change all its targets: the first one if they are random, else all."""
    return [axis[0]] if isinstance(axis, RandomOptions) else axis
