"""Options of the axes of variations: new values for one or several paths, listed in a file or drawn at random."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from simscen.loading.variations.paths import Target
from simscen.loading.yaml.tree import MappingNode, Node, ScalarNode, child, items_of

if TYPE_CHECKING:  # most scenarios have no variations
    from simscen.model.variations import Sampled


@dataclass(frozen=True)
class Change:
    """New value of a target. `number` is the number of the value among the values of its path, from 1."""

    target: Target
    value: Node
    number: int


@dataclass(frozen=True)
class Option:
    """Changes that are made together. `name` is the name of the variation in the file; "" for none."""

    changes: tuple[Change, ...]
    name: str = ""


class SampledOptions:
    """Sequence of options with values that are drawn from the distributions of `sampled` on demand.

    `distributions` is the YAML tree of the distributions by path. With the method `random`, indices beyond the length
    are valid as well.
    """

    def __init__(self, sampled: "Sampled", distributions: MappingNode, targets: Sequence[Target]) -> None:
        self.sampled, self.targets, self._distributions = sampled, targets, distributions

    def __len__(self) -> int:
        return self.sampled.count

    def __getitem__(self, index: int) -> Option:
        from simscen.loading.variations.sampling import probability

        return self.option([probability(self.sampled, target.path, index) for target in self.targets], index + 1)

    def option(self, probabilities: Sequence[float], number: int = 1) -> Option:
        """Return the option with the quantiles at these cumulative probabilities, one for each target.

        `number` is the number of the option, from 1.
        """
        from simscen.loading.variations.sampling import quantile

        changes = []
        for target, probability in zip(self.targets, probabilities, strict=True):
            value = quantile(self.sampled.values[target.path], probability)
            node = self._distributions.entries[target.path].value
            items = items_of(child(node, "choice"))
            changes.append(Change(target, items[value] if items else ScalarNode(node.position, value), number))
        return Option(tuple(changes))


Axis = Sequence[Option] | SampledOptions
"""Options of which each variation uses one."""


def typical_options(axis: Axis) -> Sequence[Option]:
    """Return options of an axis that together change all targets of the axis.

    These are the first option if the options are drawn, and otherwise all options.
    """
    return [axis[0]] if isinstance(axis, SampledOptions) else axis
