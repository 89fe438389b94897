"""Space of values that `simscen falsify` searches: one dimension for each path under `sampled` in `variations:`."""

from collections.abc import Sequence
from dataclasses import dataclass

from simscen.core.errors import Problem
from simscen.loading.schema.validate import check
from simscen.loading.variations.axes import AxisBuilder
from simscen.loading.variations.conditions import Condition, all_hold, plain_values
from simscen.loading.variations.expand import VARIATIONS, Variation
from simscen.loading.variations.options import Change, value_node
from simscen.loading.variations.paths import Target
from simscen.loading.variations.sampling import value_at
from simscen.loading.yaml.tree import MappingNode, SequenceNode, node_at
from simscen.model.variations import OneOf, Sampled, VariationsSection


@dataclass(frozen=True)
class SearchSpace:
    """Distributions of the values of `targets`, and conditions on them. Each target is one dimension, in this order.

    `tree` is the scenario without `variations`, and `ranges` is the tree of the distributions, by path.
    """

    tree: MappingNode
    sampled: Sampled
    ranges: MappingNode
    targets: Sequence[Target]
    conditions: Sequence[Condition]

    @property
    def choice_counts(self) -> list[int]:
        """For each dimension, the number of values of a `choice`; 0 for other distributions."""
        chosen = [self.sampled.values[target.path].chosen for target in self.targets]
        return [len(one.root) if isinstance(one, OneOf) else 0 for one in chosen]

    def variation(self, name: str, point: Sequence[float]) -> Variation | None:
        """Return the scenario with the values at `point` as a variation; None if they do not meet the conditions.

        `point` has a cumulative probability (0 < p < 1) for each dimension, at which the value is taken from its
        distribution. Raises ConditionError if a condition cannot be evaluated.
        """
        changes = []
        for target, u in zip(self.targets, point, strict=True):
            value = value_at(self.sampled.values[target.path], u)
            changes.append(Change(target, value_node(self.ranges.entries[target.path].value, value), 1))
        if not all_hold(self.conditions, plain_values(self.tree, self.conditions, changes)):
            return None
        return Variation.of(name, self.tree, changes)


def search_space(tree: MappingNode) -> SearchSpace | list[Problem]:
    """Return the space that `variations: {sampled: …}` of a scenario describes; or the problems of `variations:`."""
    entry = tree.entries.get(VARIATIONS)
    if entry is None:
        message, hint = "the scenario has no `variations` to search", "add `sampled` with the range of each value"
        return [Problem(*tree.position, "SC010", message, hint)]
    own = tree.without_keys(VARIATIONS)
    section = check(VariationsSection, MappingNode(tree.position, {VARIATIONS: entry}))
    if isinstance(section, list):
        return section
    blocks = section.variations.blocks
    node = entry.value.items[0] if isinstance(entry.value, SequenceNode) and entry.value.items else entry.value
    if len(blocks) != 1 or not blocks[0].is_sampled_alone:
        message, hint = "only the ranges of `sampled` can be searched", "write one block with `sampled` alone"
        return [Problem(*entry.value.position, "SC016", message, hint)]
    builder, block = AxisBuilder(own), blocks[0]
    conditions = builder.read_conditions(node)
    builder.build_axes(block, node, conditions)
    builder.check_condition_paths(conditions, node)
    if builder.problems:
        return builder.problems
    ranges = node_at(node, ("sampled", "values"))
    assert isinstance(ranges, MappingNode)
    assert block.sampled is not None
    targets = [builder.targets[path] for path in ranges.entries]
    return SearchSpace(own, block.sampled, ranges, targets, conditions)
