"""Expand a scenario with `variations:` to one scenario for each variation.

`variations:` consists of one or more blocks. Each block combines the options of its axes (see axes.py).
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from simscen.core.errors import Problem
from simscen.loading.schema.validate import check
from simscen.loading.variations.axes import AxisBuilder
from simscen.loading.variations.conditions import Condition, ConditionError, all_hold, plain_values
from simscen.loading.variations.naming import derive_name, make_unique, name_error, numbered_name, short_names
from simscen.loading.variations.options import Change, Option, typical_options
from simscen.loading.variations.paths import Target, set_value
from simscen.loading.yaml.tree import MappingNode, Node, Position, SequenceNode

VARIATIONS, ACCEPTANCE = "variations", "acceptance"
"""Keys of a scenario."""
MAX_TOTAL_VALUES = 5_000_000
"""Limit on the number of keys and values of all variations of a scenario together, which bounds their memory."""
MAX_REJECTED_DRAWS = 10_000
"""Number of consecutive draws that do not meet `require` after which drawing is given up with an error."""
_DESCRIPTIVE_KEYS = frozenset({"description", "tags", "expected", "skip"})
"""Top-level keys that do not change what happens in a run. Their values do not appear in names of variations."""


@dataclass(frozen=True)
class Variation:
    """Tree of a scenario in which `changes` have been made. A file without variations has one, with the name ""."""

    name: str
    tree: MappingNode = field(repr=False)
    changes: tuple[Change, ...] = ()

    @classmethod
    def of(cls, name: str, tree: MappingNode, changes: Sequence[Change]) -> "Variation":
        """Make the changes to `tree`, and return the variation."""
        for change in changes:
            tree = set_value(tree, change.target, change.value)
        return cls(name, tree, tuple(changes))

    @property
    def set_by(self) -> Mapping[Position, str]:
        """The path that set a value, by the position of the value; also for the parts of a changed mapping or list."""
        return {
            position: change.target.path
            for change in self.changes
            for position in (*_positions(change.value), change.target.position)
        }

    @property
    def values(self) -> dict[str, Any]:
        """The changed values by path."""
        return {change.target.path: change.value.plain for change in self.changes}


@dataclass(frozen=True)
class Block:
    """A block of variations: axes whose options are combined, and conditions that a combination must meet.

    With `is_random`, it has a single axis, whose options are drawn at random.
    """

    axes: Sequence[Sequence[Option]]
    conditions: Sequence[Condition]
    is_random: bool

    @property
    def count(self) -> int:
        """Number of combinations, including those that do not meet the conditions."""
        return math.prod(map(len, self.axes))

    def options(self, index: int) -> list[Option]:
        """Return the options of the combination with this index, from 0. The last axis changes fastest."""
        if self.is_random:
            return [self.axes[0][index]]
        chosen = []
        for axis in reversed(self.axes):
            index, own = divmod(index, len(axis))
            chosen.append(axis[own])
        return chosen[::-1]


@dataclass(frozen=True)
class VariationSpace:
    """All variations of the scenario `tree`. They are numbered from 1 and built on demand.

    `targets` are the targets of all varied paths, by path. With `is_random`, the variations are independent random
    draws, and there is no largest number.
    """

    tree: MappingNode
    blocks: Sequence[Block]
    targets: Mapping[str, Target]
    is_random: bool

    @property
    def count(self) -> int:
        """Number of variations, including those that do not meet the conditions; of random draws, the number to run."""
        return sum(block.count for block in self.blocks)

    def variation(self, number: int) -> Variation | None:
        """Return the variation with this number, called `variation-<number>`; None if it does not meet the conditions.

        Raises ConditionError if a condition cannot be evaluated, and IndexError if there is no such variation.
        """
        options = self._options(number)
        return None if options is None else self._build(numbered_name(number), options)

    def meets_conditions(self, number: int) -> bool:
        """Return whether the variation with this number meets the conditions. Raises ConditionError and IndexError."""
        return self._options(number) is not None

    def numbers(self) -> Iterator[int]:
        """Yield the numbers of the variations that `simscen run` runs: those that meet the conditions.

        For random draws, these are the first `count` of them. Raises ConditionError if a condition cannot be evaluated,
        or if too many draws in a row do not meet the conditions.
        """
        if not self.is_random:
            yield from (number for number in range(1, self.count + 1) if self._options(number) is not None)
            return
        found, number, rejected = 0, 0, 0
        while found < self.count:
            number += 1
            if self._options(number) is not None:
                found, rejected = found + 1, 0
                yield number
            elif (rejected := rejected + 1) == MAX_REJECTED_DRAWS:
                raise ConditionError(f"none of {MAX_REJECTED_DRAWS} draws in a row meets the conditions")

    def all_named(self) -> list[Variation]:
        """Return the variations that `simscen run` runs, named after the values that differ. Raises ConditionError."""
        numbers = list(self.numbers())
        chosen = [options for number in numbers if (options := self._options(number)) is not None]
        values = [
            {change.target.path: change.value.plain for o in options for change in o.changes} for options in chosen
        ]
        differ = {path for path in self.targets if any(value.get(path) != values[0].get(path) for value in values)}
        all_targets = list(self.targets.values())
        named_targets = [target for target in all_targets if target.keys[0] not in _DESCRIPTIVE_KEYS] or all_targets
        keys = short_names([target for target in named_targets if target.path in differ] or named_targets)
        names = [_name(options, keys, number) for number, options in zip(numbers, chosen, strict=True)]
        is_named = [len(options) == 1 and bool(options[0].name) for options in chosen]
        return [self._build(name, options) for options, name in zip(chosen, make_unique(names, is_named), strict=True)]

    def _options(self, number: int) -> list[Option] | None:
        """Return the options of a variation; None if it does not meet the conditions. Raises IndexError."""
        index = number - 1
        for block in self.blocks:
            if index < block.count or self.is_random:
                options = block.options(index)
                changes = [change for option in options for change in option.changes]
                is_allowed = all_hold(block.conditions, plain_values(self.tree, block.conditions, changes))
                return options if is_allowed else None
            index -= block.count
        raise IndexError(number)

    def _build(self, name: str, options: Sequence[Option]) -> Variation:
        return Variation.of(name, self.tree, [change for option in options for change in option.changes])


def expand_variations(tree: MappingNode, numbers: Sequence[int] | None = None) -> list[Variation] | list[Problem]:
    """Return all variations of a scenario in order, or those with these `numbers`; or problems of `variations:`.

    Numbers that do not exist, or whose variations do not meet the conditions, are skipped. A scenario without
    `variations:` is returned as one variation with the name "".
    """
    space = variation_space(tree)
    if not isinstance(space, VariationSpace):
        return space if space is not None else [Variation("", tree)]
    position = tree.entries[VARIATIONS].value.position
    try:
        if numbers is not None:
            return [one for number in numbers if (one := _numbered(space, number)) is not None]
        if problem := _too_many_problem(space, position):
            return [problem]
        found = space.all_named()
    except ConditionError as error:
        return [Problem(*_require_position(tree), "SC016", str(error), "")]
    if not found and space.count:
        return [Problem(*_require_position(tree), "SC016", "no variation meets the conditions", "")]
    return found or [Variation("", space.tree)]


def variation_space(tree: MappingNode) -> VariationSpace | list[Problem] | None:
    """Return the variations of a scenario; None if it has no `variations:`; or the problems of its `variations:`."""
    entry = tree.entries.get(VARIATIONS)
    if entry is None:
        return None
    from simscen.model.variations import VariationsSection  # most scenarios have no variations

    own = tree.without_keys(VARIATIONS)
    section = check(VariationsSection, MappingNode(tree.position, {VARIATIONS: entry}))
    if isinstance(section, list):
        return section
    builder, found = AxisBuilder(own), []
    specs = section.variations.blocks
    nodes = entry.value.items if isinstance(entry.value, SequenceNode) else [entry.value]
    is_random = len(specs) == 1 and specs[0].is_random
    for block, node in zip(specs, nodes, strict=True):
        conditions = builder.read_conditions(node)
        axes = [] if builder.problems and block.pairwise else builder.build_axes(block, node, conditions)
        builder.check_condition_paths(conditions, node)
        found.append(Block(axes, conditions, is_random))
    if specs and not is_random and ACCEPTANCE in tree.entries:
        message = "these variations are not independent random draws, so no confidence can be stated for a pass rate"
        hint = "vary with `sampled` and `method: random` alone, or remove `acceptance`"
        builder.add_problem(tree.entries[ACCEPTANCE].key, "SC016", message, hint)
    return builder.problems or VariationSpace(own, found, builder.targets, is_random)


def _numbered(space: VariationSpace, number: int) -> Variation | None:
    """Return the variation with this number; None if it does not exist or does not meet the conditions."""
    try:
        return space.variation(number)
    except IndexError:
        return None


def _too_many_problem(space: VariationSpace, position: Position) -> Problem | None:
    """Return a problem if there are too many variations, or too many values in all of them; else None."""
    from simscen.model.variations import MAX_VARIATIONS

    if space.count > MAX_VARIATIONS:
        message = f"the scenario has {space.count} variations; the limit is {MAX_VARIATIONS}"
        return Problem(
            *position, "SC017", message, "run them with `simscen study`, or use `sampled` to draw some of them"
        )
    sizes = (sum(max(map(_option_size, typical_options(axis))) for axis in block.axes) for block in space.blocks)
    values = _size(space.tree) + max(sizes, default=0)
    if space.count * values > MAX_TOTAL_VALUES:
        message = (
            f"{space.count} variations of up to {values} values exceed the limit of {MAX_TOTAL_VALUES} values in total"
        )
        return Problem(*position, "SC006", message)
    return None


def _require_position(tree: MappingNode) -> Position:
    """Return the position of the first `require`; that of `variations` if there is none."""
    value = tree.entries[VARIATIONS].value
    for block in value.items if isinstance(value, SequenceNode) else [value]:
        if isinstance(block, MappingNode) and "require" in block.entries:
            return block.entries["require"].value.position
    return value.position


def _name(options: Sequence[Option], keys: dict[str, str], number: int) -> str:
    """Return the name of the variation with these options; `keys` has the short name of each path that it shows."""
    parts = []
    for option in options:
        shown = [change for change in option.changes if change.target.path in keys]
        values = {change.target.path: change.value for change in shown}
        numbers = {change.target.path: change.number for change in shown}
        parts.append(option.name or (derive_name(keys, values, numbers, number) if values else ""))
    name = ",".join(part for part in parts if part)
    return name if name and name_error(name) is None else numbered_name(number)


def _option_size(option: Option) -> int:
    return sum(_size(change.value) for change in option.changes)


def _size(node: Node) -> int:
    """Return the number of keys and values of a node, including itself."""
    return sum(1 for _ in _positions(node))


def _positions(node: Node) -> Iterator[Position]:
    """Yield the positions of a node and of all keys and values below it."""
    yield node.position
    if isinstance(node, MappingNode):
        for entry in node.entries.values():
            yield entry.key
            yield from _positions(entry.value)
    elif isinstance(node, SequenceNode):
        for item in node.items:
            yield from _positions(item)
