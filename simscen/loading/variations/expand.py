"""Expands a scenario with `variations` to one scenario for each variation.

`variations` has one or more blocks. A block has axes, and an axis has options (new values for some paths). Each
variation of a block combines one option of each axis.
"""

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from simscen.core.errors import Problem
from simscen.loading.schema.validate import check
from simscen.loading.variations.axes import AxisBuilder
from simscen.loading.variations.conditions import Condition, ConditionError, all_hold
from simscen.loading.variations.naming import derive_name, make_unique, name_error, numbered_name, short_names
from simscen.loading.variations.options import Axis, Change, Option, typical_options
from simscen.loading.variations.paths import Target
from simscen.loading.yaml.tree import MappingNode, Node, Position, SequenceNode, child, entries_of, items_of

VARIATIONS, ACCEPTANCE = "variations", "acceptance"
"""Top-level keys of a scenario."""
MAX_TOTAL_VALUES = 5_000_000
"""Maximum number of keys and values in all variations of a scenario together."""
MAX_REJECTED_DRAWS = 10_000
"""Number of consecutive random draws that violate the conditions after which an error is raised."""
_DESCRIPTIVE_KEYS = frozenset({"description", "tags", "expected", "skip"})
"""Top-level keys that do not affect the simulation. Names contain their values only if nothing else is varied."""


@dataclass(frozen=True)
class Variation:
    """Variation of a scenario. `tree` contains the new values in `changes`. `name` is "" without `variations`."""

    name: str
    tree: MappingNode = field(repr=False)
    changes: tuple[Change, ...] = ()

    @classmethod
    def with_changes(cls, name: str, tree: MappingNode, changes: Sequence[Change]) -> "Variation":
        """Return the variation of the scenario `tree` with these changes."""
        for change in changes:
            tree = tree.with_value(change.target.keys, change.value, change.target.position)
        return cls(name, tree, tuple(changes))

    @property
    def varied_paths(self) -> Mapping[Position, str]:
        """Path of the change that set a value, by position of the value or of a part of it."""
        return {
            position: change.target.path
            for change in self.changes
            for position in (*_positions(change.value), change.target.position)
        }

    @property
    def values(self) -> dict[str, Any]:
        """The new values by path."""
        return {change.target.path: change.value.plain for change in self.changes}


@dataclass(frozen=True)
class Block:
    """Block of variations: combinations of axes that meet conditions, or one axis of random draws (`is_random`).

    is_pairwise:  whether an axis contains each pair of values of two parameters (`pairwise`)
    """

    axes: Sequence[Axis]
    conditions: Sequence[Condition]
    is_random: bool
    is_pairwise: bool = False

    @property
    def count(self) -> int:
        """Number of variations before conditions are applied; with `is_random`, the `count` in the file."""
        return math.prod(map(len, self.axes))

    def options(self, index: int) -> list[Option]:
        """Return the combination with this index, from 0: one option of each axis. The last axis changes fastest."""
        if self.is_random:
            return [self.axes[0][index]]
        chosen = []
        for axis in reversed(self.axes):
            index, option_index = divmod(index, len(axis))
            chosen.append(axis[option_index])
        return chosen[::-1]


@dataclass(frozen=True)
class VariationSpace:
    """All variations of a scenario. They are numbered from 1 and built on demand."""

    tree: MappingNode
    """YAML tree of the scenario without its key `variations`."""
    blocks: Sequence[Block]
    targets: Mapping[str, Target]
    """Targets of all varied paths, by path."""
    is_random: bool
    """Whether the variations are independent random draws. If so, their numbers have no upper limit."""

    @property
    def count(self) -> int:
        """Number of variations, including variations that do not meet the conditions.

        With `is_random`, this is the `count` in the file.
        """
        return sum(block.count for block in self.blocks)

    def variation(self, number: int) -> Variation | None:
        """Return the variation with this number; None if it does not meet the conditions.

        Raises ConditionError if a condition cannot be evaluated, and IndexError for an unknown number.
        """
        options = self._options(number)
        return None if options is None else Variation.with_changes(numbered_name(number), self.tree, _changes(options))

    def numbers(self) -> Iterator[int]:
        """Yield the numbers of the variations that meet the conditions; with `is_random`, without end.

        Raises ConditionError, also if MAX_REJECTED_DRAWS consecutive draws do not meet the conditions.
        """
        rejected = 0
        for number in itertools.count(1) if self.is_random else range(1, self.count + 1):
            if self._options(number) is not None:
                rejected = 0
                yield number
            elif (rejected := rejected + 1) == MAX_REJECTED_DRAWS and self.is_random:
                raise ConditionError(f"none of {MAX_REJECTED_DRAWS} draws in a row meets the conditions in `require`")

    def named_variations(self) -> list[Variation]:
        """Return the first `count` variations of `numbers()`. Their names contain the values that differ.

        Raises ConditionError.
        """
        numbers = list(itertools.islice(self.numbers(), self.count))
        chosen = [options for number in numbers if (options := self._options(number)) is not None]
        values = [{change.target.path: change.value.plain for change in _changes(options)} for options in chosen]
        differ = {path for path in self.targets if any(value.get(path) != values[0].get(path) for value in values)}
        all_targets = list(self.targets.values())
        named_targets = [target for target in all_targets if target.keys[0] not in _DESCRIPTIVE_KEYS] or all_targets
        keys = short_names([target for target in named_targets if target.path in differ] or named_targets)
        names = [_variation_name(options, keys, number) for number, options in zip(numbers, chosen, strict=True)]
        is_named = [len(options) == 1 and bool(options[0].name) for options in chosen]
        names = make_unique(names, is_named)
        return [Variation.with_changes(name, self.tree, _changes(o)) for name, o in zip(names, chosen, strict=True)]

    def _options(self, number: int) -> list[Option] | None:
        """Return the options of a variation; None if it violates conditions. Raises ConditionError, IndexError."""
        index = number - 1
        for block in self.blocks:
            if index < block.count or self.is_random:
                options = block.options(index)
                return options if all_hold(block.conditions, self.tree, _changes(options)) else None
            index -= block.count
        raise IndexError(number)


def _changes(options: Sequence[Option]) -> list[Change]:
    return [change for option in options for change in option.changes]


def expand_variations(tree: MappingNode, numbers: Sequence[int] | None = None) -> list[Variation] | list[Problem]:
    """Return the variations of a scenario that meet the conditions; or the problems of its `variations`.

    `numbers` selects variations, which get names such as `variation-7`; unknown numbers are ignored. A scenario
    without `variations` is one variation with the name "".
    """
    space = variation_space(tree)
    if not isinstance(space, VariationSpace):
        return space if space is not None else [Variation("", tree)]
    position = tree.entries[VARIATIONS].value.position
    try:
        if numbers is not None:
            known = [number for number in numbers if space.is_random or 0 < number <= space.count]
            return [variation for number in known if (variation := space.variation(number)) is not None]
        if problem := _too_many_problem(space, position):
            return [problem]
        found = space.named_variations()
    except ConditionError as error:
        return [Problem(*_position_of_require(tree), "SC016", str(error), "")]
    if not found and space.blocks:
        return [Problem(*_position_of_require(tree), "SC016", "no variation meets the conditions", "")]
    return found or [Variation("", space.tree)]


def variation_space(tree: MappingNode) -> VariationSpace | list[Problem] | None:
    """Return the space of variations of a scenario; None without `variations`; or the problems of its `variations`."""
    entry = tree.entries.get(VARIATIONS)
    if entry is None:
        return None
    from simscen.model.variations import VariationsSection  # most scenarios have no variations

    base_tree = tree.without_keys(VARIATIONS)
    section = check(VariationsSection, MappingNode(tree.position, {VARIATIONS: entry}))
    if isinstance(section, list):
        return section
    builder, blocks = AxisBuilder(base_tree), []
    specs = section.variations.blocks
    nodes = entry.value.items if isinstance(entry.value, SequenceNode) else [entry.value]
    is_random = len(specs) == 1 and specs[0].is_random
    for block, node in zip(specs, nodes, strict=True):
        blocks.append(Block(*builder.build_block(block, node), is_random, block.pairwise is not None))
    if specs and not is_random and ACCEPTANCE in tree.entries:
        message = "these variations are not independent random draws, so no confidence can be stated for a pass rate"
        hint = "vary with `sampled` and `method: random` alone, or remove `acceptance`"
        builder.add_problem(tree.entries[ACCEPTANCE].key, "SC016", message, hint)
    return builder.problems or VariationSpace(base_tree, blocks, builder.targets, is_random)


def _too_many_problem(space: VariationSpace, position: Position) -> Problem | None:
    """Return a problem if there are too many variations, or too many values in all variations; else None."""
    from simscen.model.variations import MAX_VARIATIONS

    if space.count > MAX_VARIATIONS:
        message = f"the scenario has {space.count} variations; the limit is {MAX_VARIATIONS}"
        hint = "run them with `simscen study`, or use `sampled` to draw some of them"
        return Problem(*position, "SC017", message, hint)
    sizes = (
        sum(max((_option_size(option) for option in typical_options(axis)), default=0) for axis in block.axes)
        for block in space.blocks
    )
    values = _node_size(space.tree) + max(sizes, default=0)
    if space.count * values > MAX_TOTAL_VALUES:
        limit = f"the limit of {MAX_TOTAL_VALUES} values in total"
        return Problem(*position, "SC006", f"{space.count} variations of up to {values} values exceed {limit}")
    return None


def _position_of_require(tree: MappingNode) -> Position:
    """Return the position of the first `require` in `variations`; the position of `variations` if there is none."""
    value = tree.entries[VARIATIONS].value
    for block in items_of(value) or [value]:
        if (require := child(block, "require")) is not None:
            return require.position
    return value.position


def _variation_name(options: Sequence[Option], keys: dict[str, str], number: int) -> str:
    """Return the name of a variation with these options. `keys` are short names by path, for paths in the name."""
    parts = []
    for option in options:
        named_changes = [change for change in option.changes if change.target.path in keys]
        parts.append(option.name or (derive_name(keys, named_changes, number) if named_changes else ""))
    name = ",".join(part for part in parts if part)
    return name if name and name_error(name) is None else numbered_name(number)


def _option_size(option: Option) -> int:
    return sum(_node_size(change.value) for change in option.changes)


def _node_size(node: Node) -> int:
    """Return the number of keys and values of a node, including itself."""
    return sum(1 for _ in _positions(node))


def _positions(node: Node) -> Iterator[Position]:
    """Yield the positions of a node and of all keys and values below it."""
    yield node.position
    for entry in entries_of(node).values():
        yield entry.key
        yield from _positions(entry.value)
    for item in items_of(node):
        yield from _positions(item)
