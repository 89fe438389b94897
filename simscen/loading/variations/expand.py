"""Expand a scenario with `variations:` to one tree per variation."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import combinations, product
from typing import TYPE_CHECKING

from simscen.core.errors import Problem
from simscen.loading.schema.messages import quoted
from simscen.loading.schema.validate import check
from simscen.loading.variations.naming import NAME_HINT, derive_name, make_unique, name_error, short_names
from simscen.loading.variations.paths import PathError, Target, resolve_path, set_value
from simscen.loading.yaml.tree import Entry, MappingNode, Node, Position, ScalarNode, SequenceNode, child, node_at

if TYPE_CHECKING:  # most scenarios have no variations
    from simscen.model.variations import Sampled, VariationBlock

VARIATIONS = "variations"
MAX_TOTAL_VALUES = 5_000_000
"""Limit on the number of values of all variations of a scenario together."""
_DESCRIPTIVE_KEYS = frozenset({"description", "tags", "expected", "skip"})
"""Keys that do not change the run, and so do not appear in names of variations."""


@dataclass(frozen=True)
class Change:
    """Value for a path; `number` counts the values of the path from 1."""

    target: Target
    value: Node
    number: int


@dataclass(frozen=True)
class Option:
    """Changes that belong together, and their name if the author gave one."""

    changes: tuple[Change, ...]
    name: str = ""


@dataclass(frozen=True)
class Variation:
    """Scenario with the values of `changes`; a file without variations is a single variation without a name."""

    name: str
    tree: MappingNode = field(repr=False)
    changes: tuple[Change, ...] = ()

    @property
    def set_by(self) -> Mapping[Position, str]:
        """The path of each changed value, by the position of the value and of each of its parts."""
        return {
            place: change.target.path
            for change in self.changes
            for place in (*_places(change.value), change.target.place)
        }


def expand_variations(tree: MappingNode) -> list[Variation] | list[Problem]:
    """Return all variations of a scenario in order, or the problems of its `variations`."""
    entry = tree.entries.get(VARIATIONS)
    if entry is None:
        return [Variation("", tree)]
    from simscen.model.variations import MAX_VARIATIONS, VariationsSection

    own = MappingNode(tree.place, {key: value for key, value in tree.entries.items() if key != VARIATIONS})
    said = check(VariationsSection, MappingNode(tree.place, {VARIATIONS: entry}))
    if isinstance(said, list):
        return said
    expansion = _Expansion(own)
    blocks = said.variations.blocks
    nodes = entry.value.items if isinstance(entry.value, SequenceNode) else [entry.value]
    axes = [expansion.axes(block, node) for block, node in zip(blocks, nodes, strict=True)]
    if expansion.problems:
        return expansion.problems
    if (number := sum(math.prod(map(len, block)) for block in axes)) > MAX_VARIATIONS:
        message = f"the scenario has {number} variations; the limit is {MAX_VARIATIONS}"
        return [Problem(*entry.value.place, "SC017", message, "use `sampled` to draw some of them")]
    values = _size(own) + max((sum(max(map(_weight, axis)) for axis in block) for block in axes), default=0)
    if number * values > MAX_TOTAL_VALUES:
        message = f"{number} variations of up to {values} values exceed the limit of {MAX_TOTAL_VALUES} values in total"
        return [Problem(*entry.value.place, "SC006", message)]
    options = [list(chosen) for block in axes for chosen in product(*block)]
    return expansion.named(options) if options else [Variation("", own)]


@dataclass
class _Expansion:
    """Builder of the variations of `tree`; collects problems."""

    tree: MappingNode
    problems: list[Problem] = field(default_factory=list)
    _targets: dict[str, Target] = field(default_factory=dict)
    _names: dict[str, Position] = field(default_factory=dict)

    def axes(self, block: "VariationBlock", node: Node) -> list[list[Option]]:
        """Return the axes whose options are combined: each path of a grid, and each other kind as a whole."""
        found = [[Option((change,)) for change in changes] for changes in self._columns(child(node, "grid"), True)]
        if block.pairs is not None:
            found.append(self._pairs(child(node, "pairs")))
        if block.list_ is not None:
            found.append(self._list(child(node, "list")))
        if block.sampled is not None:
            found.append(self._sampled(block.sampled, node_at(node, ("sampled", "values"))))
        self._require_apart(found)
        return found

    def named(self, chosen: Sequence[Sequence[Option]]) -> list[Variation] | list[Problem]:
        """Return the variations with their names."""
        values = [
            {change.target.path: change.value.plain for o in options for change in o.changes} for options in chosen
        ]
        differ = {path for path in self._targets if any(one.get(path) != values[0].get(path) for one in values)}
        everything = list(self._targets.values())
        named = [target for target in everything if target.keys[0] not in _DESCRIPTIVE_KEYS] or everything
        keys = short_names([target for target in named if target.path in differ] or named)
        names = [self._name(options, keys, number) for number, options in enumerate(chosen, start=1)]
        given = [len(options) == 1 and bool(options[0].name) for options in chosen]
        variations = []
        for options, name in zip(chosen, make_unique(names, given), strict=True):
            changes = tuple(change for option in options for change in option.changes)
            tree = self.tree
            for change in changes:
                tree = set_value(tree, change.target, change.value)
            variations.append(Variation(name, tree, changes))
        return variations

    def _name(self, options: Sequence[Option], keys: dict[str, str], number: int) -> str:
        parts = []
        for option in options:
            shown = [change for change in option.changes if change.target.path in keys]
            values = {change.target.path: change.value for change in shown}
            numbers = {change.target.path: change.number for change in shown}
            parts.append(option.name or (derive_name(keys, values, numbers, number) if values else ""))
        name = ",".join(part for part in parts if part)
        return name if name and name_error(name) is None else f"variation-{number}"

    def _columns(self, node: Node | None, distinct: bool) -> list[list[Change]]:
        """Return the changes of each path."""
        if not isinstance(node, MappingNode):
            return []
        found = []
        for path, entry in node.entries.items():
            assert isinstance(entry.value, SequenceNode)
            if distinct:
                self._refuse_equal(entry.value)
            if (target := self._target(path, entry)) is not None:
                found.append([Change(target, value, n) for n, value in enumerate(entry.value.items, start=1)])
        return found

    def _pairs(self, node: Node | None) -> list[Option]:
        assert isinstance(node, MappingNode)
        lengths = {
            path: len(entry.value.items)
            for path, entry in node.entries.items()
            if isinstance(entry.value, SequenceNode)
        }
        first, *others = lengths
        for path in others:
            if lengths[path] != lengths[first]:
                message = f"{quoted(path)} has {lengths[path]} values, {quoted(first)} has {lengths[first]}"
                hint = "the lists of `pairs` must have the same length"
                self._add(node.entries[path].value.place, "SC016", message, hint)
                return []
        return [Option(changes) for changes in zip(*self._columns(node, False), strict=True)]

    def _list(self, node: Node | None) -> list[Option]:
        assert isinstance(node, SequenceNode)
        found = []
        for number, item in enumerate(node.items, start=1):
            assert isinstance(item, MappingNode)
            name = self._given_name(item)
            entries = [(path, entry) for path, entry in item.entries.items() if path != "name"]
            if not entries:
                self._add(item.place, "SC010", "this variation changes nothing", "add a path and its value")
            targets = [(self._target(path, entry), entry) for path, entry in entries]
            changes = [Change(target, entry.value, number) for target, entry in targets if target is not None]
            self._require_apart([[Option((change,))] for change in changes])
            found.append(Option(tuple(changes), name))
        return found

    def _given_name(self, item: MappingNode) -> str:
        entry = item.entries.get("name")
        if entry is None:
            return ""
        place, value = entry.value.place, entry.value.plain
        name = value if isinstance(value, str) else str(value) if isinstance(value, int | float) else ""
        if (flaw := name_error(name)) is not None:
            self._add(place, "SC017", flaw, NAME_HINT)
        first = self._names.setdefault(name.casefold(), place)
        if first != place:
            self._add(place, "SC033", f"the variation at line {first.line} is also called {quoted(name)}")
        return name

    def _sampled(self, sampled: "Sampled", node: Node) -> list[Option]:
        from simscen.loading.variations.sampling import Pick, draw_values

        assert isinstance(node, MappingNode)
        columns = []
        for path, entry in node.entries.items():
            target = self._target(path, entry)
            drawn = entry.value
            try:
                values = draw_values(sampled, path)
            except ValueError as error:
                self._add(drawn.place, "SC016", str(error))
                continue
            nodes = [
                node_at(drawn, ("choice", v.number)) if isinstance(v, Pick) else ScalarNode(drawn.place, v)
                for v in values
            ]
            if target is not None:
                columns.append([Change(target, value, n) for n, value in enumerate(nodes, start=1)])
        return [Option(changes) for changes in zip(*columns, strict=True)]

    def _target(self, path: str, entry: Entry) -> Target | None:
        try:
            target = resolve_path(path, entry.key, self.tree)
        except PathError as error:
            self._add(entry.key, "SC030", str(error), error.hint)
            return None
        self._targets.setdefault(path, target)
        return target

    def _refuse_equal(self, items: SequenceNode) -> None:
        seen: list[object] = []
        for item in items.items:
            if item.plain in seen:
                self._add(item.place, "SC054", "this value is listed twice", "remove one of them")
            seen.append(item.plain)

    def _require_apart(self, axes: Sequence[Sequence[Option]]) -> None:
        """Report axes that change the same value, or a part of each other's values."""
        targets = [{change.target.path: change.target for o in axis for change in o.changes} for axis in axes]
        for above, below in combinations(targets, 2):
            for one, other in product(above.values(), below.values()):
                shorter = min(len(one.keys), len(other.keys))
                if one.keys[:shorter] == other.keys[:shorter]:
                    same = len(one.keys) == len(other.keys)
                    what = "change the same value" if same else "overlap: one is part of the other"
                    self._add(other.place, "SC054", f"{quoted(one.path)} and {quoted(other.path)} {what}")

    def _add(self, place: Position, code: str, message: str, hint: str = "") -> None:
        problem = Problem(*place, code=code, message=message, hint=hint)
        if problem not in self.problems:
            self.problems.append(problem)


def _weight(option: Option) -> int:
    return sum(_size(change.value) for change in option.changes)


def _size(node: Node) -> int:
    """Return the number of values below a node."""
    return sum(1 for _ in _places(node))


def _places(node: Node) -> Iterator[Position]:
    yield node.place
    if isinstance(node, MappingNode):
        for entry in node.entries.values():
            yield entry.key
            yield from _places(entry.value)
    elif isinstance(node, SequenceNode):
        for item in node.items:
            yield from _places(item)
