"""The ranges of `sampled` as a space to search, with one dimension for each path."""

from collections.abc import Sequence
from dataclasses import dataclass

from simscen.core.errors import Problem
from simscen.loading.schema.validate import check
from simscen.loading.variations.axes import AxisBuilder
from simscen.loading.variations.conditions import Condition, all_hold, plain_values
from simscen.loading.variations.expand import VARIATIONS, Variation
from simscen.loading.variations.options import Change, value_node
from simscen.loading.variations.paths import Target, set_value
from simscen.loading.variations.sampling import value_at
from simscen.loading.yaml.tree import MappingNode, SequenceNode, node_at
from simscen.model.variations import OneOf, Sampled, VariationsSection


@dataclass(frozen=True)
class SearchSpace:
    """Paths to vary, their distributions, and conditions. Dimensions are in the order of the paths."""

    tree: MappingNode
    sampled: Sampled
    ranges: MappingNode
    targets: Sequence[Target]
    conditions: Sequence[Condition]

    @property
    def choices(self) -> list[int]:
        """The number of values of each `choice`, 0 for other distributions."""
        chosen = [self.sampled.values[target.path].chosen for target in self.targets]
        return [len(one.root) if isinstance(one, OneOf) else 0 for one in chosen]

    def variation(self, name: str, point: Sequence[float]) -> Variation | None:
        """Return the scenario with the values at a point of the unit cube; None if they do not meet the conditions.

        Raises ConditionError if a condition cannot be evaluated.
        """
        changes = []
        for target, u in zip(self.targets, point, strict=True):
            value = value_at(self.sampled.values[target.path], u)
            changes.append(Change(target, value_node(self.ranges.entries[target.path].value, value), 1))
        if not all_hold(self.conditions, plain_values(self.tree, self.conditions, changes)):
            return None
        tree = self.tree
        for change in changes:
            tree = set_value(tree, change.target, change.value)
        return Variation(name, tree, tuple(changes))


def search_space(tree: MappingNode) -> SearchSpace | list[Problem]:
    """Return the space that `variations: {sampled: …}` of a scenario describes, or problems."""
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
    conditions = builder.conditions(node)
    builder.axes(block, node, conditions)
    builder.check_paths(conditions, node)
    if builder.problems:
        return builder.problems
    ranges = node_at(node, ("sampled", "values"))
    assert isinstance(ranges, MappingNode)
    assert block.sampled is not None
    targets = [builder.targets[path] for path in ranges.entries]
    return SearchSpace(own, block.sampled, ranges, targets, conditions)
