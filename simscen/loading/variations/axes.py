"""Builds the axes of a block of variations from its YAML tree.

A block is one item of `variations`. An axis is a list of options. An option is a new value for one path, or new values
for several paths. Each variation of a block combines one option of each axis.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import combinations, product
from typing import TYPE_CHECKING

from simscen.core.errors import Problem
from simscen.loading.schema.messages import quoted
from simscen.loading.variations.conditions import (
    GRAMMAR,
    Condition,
    ConditionError,
    all_hold,
    condition_keys,
    parse_condition,
    written_value,
)
from simscen.loading.variations.covering_arrays import Row, covering_array
from simscen.loading.variations.naming import NAME_HINT, name_error, number_of
from simscen.loading.variations.options import Axis, Change, Option, SampledOptions, typical_options
from simscen.loading.variations.paths import PathError, Target, resolve_path
from simscen.loading.yaml.tree import Entry, Keys, MappingNode, Node, Position, child, entries_of, items_of, node_at

if TYPE_CHECKING:  # most scenarios have no variations
    from simscen.model.variations import Sampled, VariationBlock


@dataclass
class AxisBuilder:
    """Builds the axes of all blocks of variations of a scenario, and collects problems."""

    tree: MappingNode
    """YAML tree of the scenario without its key `variations`."""
    problems: list[Problem] = field(default_factory=list)
    """Problems found so far."""
    targets: dict[str, Target] = field(default_factory=dict)
    """Targets of all varied paths found so far, by path."""
    _names: dict[str, Position] = field(default_factory=dict)
    """Positions of the names of variations in the file, by name in lower case."""

    def build_block(self, block: "VariationBlock", node: Node) -> tuple[list[Axis], list[Condition]]:
        """Return the axes and the conditions of a block. `node` is its YAML tree."""
        conditions = self._read_conditions(node)
        axes = [] if self.problems and block.pairwise else self._build_axes(block, node, conditions)
        items = items_of(child(node, "require"))
        if len(conditions) < len(items):  # a condition is invalid
            return axes, conditions
        for condition, item in zip(conditions, items, strict=True):
            for path in condition.paths:
                keys = condition_keys(self.tree, path)
                is_varied = any(_overlap(keys, target.keys) for target in self.targets.values())
                if not is_varied and written_value(self.tree, path) is None:
                    message = f"`{path}` is neither varied nor written in the scenario"
                    self.add_problem(item.position, "SC030", message, "write its value, or vary it")
        return axes, conditions

    def _read_conditions(self, block: Node) -> list[Condition]:
        """Return the conditions under the key `require` of a block. Report invalid conditions."""
        found = []
        for item in items_of(child(block, "require")):
            try:
                found.append(parse_condition(str(item.plain)))
            except ConditionError as error:
                self.add_problem(item.position, "SC017", str(error), GRAMMAR)
        return found

    def _build_axes(self, block: "VariationBlock", node: Node, conditions: Sequence[Condition]) -> list[Axis]:
        """Return the axes of a block: one for each path under `grid`, and one for each other kind, such as `pairs`."""
        grid = self._changes_by_path(child(node, "grid"), True)
        found: list[Axis] = [[Option((change,)) for change in changes] for changes in grid]
        pairwise = self._changes_by_path(child(node, "pairwise"), True)
        pairwise_index = len(found)
        if block.pairs is not None:
            found.append(self._pairs_options(child(node, "pairs")))
        if block.list_ is not None:
            found.append(self._list_options(child(node, "list")))
        if block.sampled is not None:
            found.append(self._sampled_options(block.sampled, node_at(node, ("sampled", "values"))))
        if block.pairwise is not None:
            found.insert(pairwise_index, self._pairwise_options(pairwise, found, conditions))
        self._report_overlaps(found)
        return found

    def _changes_by_path(self, node: Node | None, must_differ: bool) -> list[list[Change]]:
        """Return the changes of each path. `node` is a mapping from paths to values.

        With `must_differ`, a value that is listed twice is a problem.
        """
        found = []
        for path, entry in entries_of(node).items():
            values = items_of(entry.value)
            for number, value in enumerate(values):
                if must_differ and any(value.plain == other.plain for other in values[:number]):
                    self.add_problem(value.position, "SC054", "this value is listed twice", "remove one of them")
            if (target := self._resolve_target(path, entry)) is not None:
                found.append([Change(target, value, number) for number, value in enumerate(values, start=1)])
        return found

    def _pairwise_options(
        self, columns: Sequence[Sequence[Change]], other_axes: Sequence[Axis], conditions: Sequence[Condition]
    ) -> list[Option]:
        """Return options that contain each pair of changes of two columns, except pairs that conditions exclude.

        A column contains the changes of one path. Conditions on values of `other_axes` are ignored here, because these
        values are not known yet.
        """
        if self.problems or not columns:
            return []

        def option(row: Row) -> Option:
            return Option(tuple(column[value] for column, value in zip(columns, row, strict=True)))

        others = [target.keys for axis in other_axes for target in _targets_by_path(axis).values()]
        decidable = [
            condition
            for condition in conditions
            if not any(_overlap(condition_keys(self.tree, path), keys) for path in condition.paths for keys in others)
        ]

        def is_allowed(row: Row) -> bool:
            return all_hold(decidable, self.tree, option(row).changes)

        return [option(row) for row in covering_array([len(column) for column in columns], is_allowed)]

    def _pairs_options(self, node: Node | None) -> list[Option]:
        """Return one option with the first values of all paths, one with the second values, and so on."""
        (first, first_entry), *others = entries_of(node).items()
        length = len(items_of(first_entry.value))
        for path, entry in others:
            own_length = len(items_of(entry.value))
            if own_length != length:
                message = f"{quoted(path)} has {own_length} values, {quoted(first)} has {length}"
                hint = "the lists of `pairs` must have the same length"
                self.add_problem(entry.value.position, "SC016", message, hint)
                return []
        return [Option(changes) for changes in zip(*self._changes_by_path(node, False), strict=True)]

    def _list_options(self, node: Node | None) -> list[Option]:
        found = []
        for number, item in enumerate(items_of(node), start=1):
            name, changes = self._item_name(item), []
            entries = {path: entry for path, entry in entries_of(item).items() if path != "name"}
            if not entries:
                self.add_problem(item.position, "SC010", "this variation changes nothing", "add a path and its value")
            for path, entry in entries.items():
                if (target := self._resolve_target(path, entry)) is not None:
                    changes.append(Change(target, entry.value, number))
            found.append(Option(tuple(changes), name))
        return found

    def _item_name(self, item: Node) -> str:
        """Return the `name` of an item of `list`; "" for none. Report invalid, reserved, and repeated names."""
        node = child(item, "name")
        if node is None:
            return ""
        position, value = node.position, node.plain
        name = value if isinstance(value, str) else str(value) if isinstance(value, int | float) else ""
        if (error := name_error(name)) is not None:
            self.add_problem(position, "SC017", error, NAME_HINT)
        if number_of(name) is not None:
            message = f"{quoted(name)} is reserved for the variation with this number"
            self.add_problem(position, "SC017", message, "choose another name")
        first = self._names.setdefault(name.casefold(), position)
        if first != position:
            self.add_problem(position, "SC033", f"the variation at line {first.line} is also called {quoted(name)}")
        return name

    def _sampled_options(self, sampled: "Sampled", node: Node | None) -> SampledOptions:
        """Return options with drawn values. Report invalid distributions. `node` is the YAML tree of distributions."""
        from simscen.loading.variations.sampling import quantile

        assert isinstance(node, MappingNode)
        targets = []
        for path, entry in node.entries.items():
            target = self._resolve_target(path, entry)
            try:
                quantile(sampled.values[path], 0.5)
            except ValueError as error:
                self.add_problem(entry.value.position, "SC016", str(error))
                continue
            if target is not None:
                targets.append(target)
        return SampledOptions(sampled, node, targets)

    def _resolve_target(self, path: str, entry: Entry) -> Target | None:
        """Return the target of a path, and add it to `targets`. For an invalid path, report it and return None."""
        try:
            target = resolve_path(path, entry.key, self.tree)
        except PathError as error:
            self.add_problem(entry.key, "SC030", str(error), error.hint)
            return None
        self.targets.setdefault(path, target)
        return target

    def _report_overlaps(self, axes: Sequence[Axis]) -> None:
        """Report changes of one variation with overlapping targets: the same value, or a value and a part of it."""
        together = [
            tuple(change.target for change in option.changes) for axis in axes for option in typical_options(axis)
        ]
        for targets in dict.fromkeys(together):
            for first, second in combinations(targets, 2):
                self._report_overlap(first, second)
        for axis_targets, other_targets in combinations(map(_targets_by_path, axes), 2):
            for first, second in product(axis_targets.values(), other_targets.values()):
                self._report_overlap(first, second)

    def _report_overlap(self, first: Target, second: Target) -> None:
        if _overlap(first.keys, second.keys):
            is_same = len(first.keys) == len(second.keys)
            verb = "change the same value" if is_same else "overlap: one is part of the other"
            self.add_problem(second.position, "SC054", f"{quoted(first.path)} and {quoted(second.path)} {verb}")

    def add_problem(self, position: Position, code: str, message: str, hint: str = "") -> None:
        """Add a problem to `problems` unless `problems` already contains it."""
        problem = Problem(*position, code=code, message=message, hint=hint)
        if problem not in self.problems:
            self.problems.append(problem)


def _targets_by_path(axis: Axis) -> dict[str, Target]:
    return {change.target.path: change.target for option in typical_options(axis) for change in option.changes}


def _overlap(first: Keys, second: Keys) -> bool:
    """Return whether two values are the same, or one value is a part of the other. () are the keys of no value."""
    shorter = min(len(first), len(second))
    return shorter > 0 and first[:shorter] == second[:shorter]
