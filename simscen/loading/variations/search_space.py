"""Search space of `simscen falsify`: one dimension for each path under `sampled` of `variations`."""

from collections.abc import Sequence
from dataclasses import dataclass

from simscen.core.errors import Problem
from simscen.loading.variations.conditions import Condition, all_hold
from simscen.loading.variations.expand import VARIATIONS, Variation, variation_space
from simscen.loading.variations.options import SampledOptions
from simscen.loading.yaml.tree import MappingNode
from simscen.model.variations import OneOf


@dataclass(frozen=True)
class SearchSpace:
    """Distributions of the values of some paths, and conditions on the values. Each path is one dimension."""

    tree: MappingNode
    """YAML tree of the scenario without its key `variations`."""
    options: SampledOptions
    conditions: Sequence[Condition]

    @property
    def choice_counts(self) -> list[int]:
        """Number of values of each dimension that is a `choice`; 0 for other distributions."""
        chosen = [self.options.sampled.values[target.path].chosen for target in self.options.targets]
        return [len(spec.root) if isinstance(spec, OneOf) else 0 for spec in chosen]

    def variation(self, name: str, point: Sequence[float]) -> Variation | None:
        """Return the variation at a point of the space; None if the variation violates conditions.

        `point` has the cumulative probability in (0, 1) of the value of each path. Raises ConditionError if a condition
        cannot be evaluated.
        """
        changes = self.options.option(point).changes
        return (
            Variation.with_changes(name, self.tree, changes) if all_hold(self.conditions, self.tree, changes) else None
        )


def search_space(tree: MappingNode) -> SearchSpace | list[Problem]:
    """Return the search space of a scenario with `variations: {sampled: …}`; or the problems of its `variations`."""
    space = variation_space(tree)
    if isinstance(space, list):
        return space
    if space is None:
        message, hint = "the scenario has no `variations` to search", "add `sampled` with the range of each value"
        return [Problem(*tree.position, "SC010", message, hint)]
    axes = [axis for block in space.blocks for axis in block.axes]
    if len(axes) != 1 or not isinstance(axes[0], SampledOptions):
        message, hint = "only the ranges of `sampled` can be searched", "write one block with `sampled` alone"
        return [Problem(*tree.entries[VARIATIONS].value.position, "SC016", message, hint)]
    return SearchSpace(space.tree, axes[0], space.blocks[0].conditions)
