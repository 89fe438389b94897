"""Search space of `simscen falsify`: one dimension for each path under `sampled` of `variations`."""

from collections.abc import Sequence
from dataclasses import dataclass

from simscen.core.errors import Problem
from simscen.loading.schema.validate import check
from simscen.loading.variations.axes import AxisBuilder
from simscen.loading.variations.conditions import Condition, all_hold
from simscen.loading.variations.expand import VARIATIONS, Variation
from simscen.loading.variations.options import Change, value_node
from simscen.loading.variations.paths import Target
from simscen.loading.variations.sampling import quantile
from simscen.loading.yaml.tree import MappingNode, items_of, node_at
from simscen.model.variations import OneOf, Sampled, VariationsSection


@dataclass(frozen=True)
class SearchSpace:
    """Distributions of the values of some paths, and conditions on the values. Each path is one dimension."""

    tree: MappingNode
    """YAML tree of the scenario without its key `variations`."""
    sampled: Sampled
    distributions: MappingNode
    """YAML tree of the distributions by path."""
    targets: Sequence[Target]
    conditions: Sequence[Condition]

    @property
    def choice_counts(self) -> list[int]:
        """Number of values of each dimension that is a `choice`; 0 for other distributions."""
        chosen = [self.sampled.values[target.path].chosen for target in self.targets]
        return [len(one.root) if isinstance(one, OneOf) else 0 for one in chosen]

    def variation(self, name: str, point: Sequence[float]) -> Variation | None:
        """Return the variation at a point of cumulative probabilities in (0, 1); None if it violates conditions.

        Raises ConditionError if a condition cannot be evaluated.
        """
        changes = []
        for target, probability in zip(self.targets, point, strict=True):
            value = quantile(self.sampled.values[target.path], probability)
            changes.append(Change(target, value_node(self.distributions.entries[target.path].value, value), 1))
        if not all_hold(self.conditions, self.tree, changes):
            return None
        return Variation.with_changes(name, self.tree, changes)


def search_space(tree: MappingNode) -> SearchSpace | list[Problem]:
    """Return the search space of a scenario with `variations: {sampled: …}`; or the problems of its `variations`."""
    entry = tree.entries.get(VARIATIONS)
    if entry is None:
        message, hint = "the scenario has no `variations` to search", "add `sampled` with the range of each value"
        return [Problem(*tree.position, "SC010", message, hint)]
    own = tree.without_keys(VARIATIONS)
    section = check(VariationsSection, MappingNode(tree.position, {VARIATIONS: entry}))
    if isinstance(section, list):
        return section
    blocks = section.variations.blocks
    node = next(iter(items_of(entry.value)), entry.value)
    if len(blocks) != 1 or not blocks[0].is_sampled_alone:
        message, hint = "only the ranges of `sampled` can be searched", "write one block with `sampled` alone"
        return [Problem(*entry.value.position, "SC016", message, hint)]
    builder, block = AxisBuilder(own), blocks[0]
    _, conditions = builder.build_block(block, node)
    if builder.problems:
        return builder.problems
    distributions = node_at(node, ("sampled", "values"))
    assert isinstance(distributions, MappingNode)
    assert block.sampled is not None
    targets = [builder.targets[path] for path in distributions.entries]
    return SearchSpace(own, block.sampled, distributions, targets, conditions)
