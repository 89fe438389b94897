"""Reduction of scenarios for `simscen shrink`: removes parts, rounds numbers, and lists the changes.

A part is a value in the YAML tree of a scenario, given by its keys, e.g. ("goals", 0, "pose").
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

from simscen.loading.yaml.tree import (
    Entry,
    Keys,
    MappingNode,
    Node,
    ScalarNode,
    SequenceNode,
    child,
    dotted_path,
    key_position,
    node_at,
    nodes_with_keys,
)
from simscen.spec.quantities import NUMBER_AND_UNIT_PATTERN, UNITS

REQUIRED_KEYS = frozenset({"simscen", "world", "robot", "robots", "seed", "pass", "time_limit"})
"""Top-level keys that are never removed."""
FIXED_KEYS = frozenset({"simscen", "seed", "pass", "time_limit"})
"""Top-level keys with values that are never changed. They define the failure and the length of the run."""
FIXED_WORLD_PARTS = frozenset({("world", "walls"), ("world", "map"), ("world", "sdf")})
"""Parts of an inline world that are never changed. Without these parts, a criterion could fail for another reason."""
UNNEEDED_KEYS = frozenset({"acceptance", "description", "expected", "metrics", "skip", "tags", "variations"})
"""Top-level keys that do not affect a run."""
MAX_DIGITS = 3
"""Maximum number of significant digits to which numbers are rounded."""


class Rounding(NamedTuple):
    """Keys of a number in a scenario, and the rounded value; text for a quantity with a unit."""

    keys: Keys
    value: str | float | int


def removable_parts(tree: MappingNode, depth: int) -> list[Keys]:
    """Return the keys of the removable parts at `depth`, in the order of the file. Depth 1 is the top level."""
    return [
        keys
        for keys, _ in nodes_with_keys(tree)
        if len(keys) == depth
        and keys[0] not in FIXED_KEYS
        and keys[:2] not in FIXED_WORLD_PARTS
        and not (depth == 1 and keys[0] in REQUIRED_KEYS)
    ]


def max_depth(tree: MappingNode) -> int:
    """Return the depth of the deepest part; 1 is the top level."""
    return max(len(keys) for keys, _ in nodes_with_keys(tree))


def without_parts(tree: MappingNode, parts: Collection[Keys]) -> MappingNode:
    """Return the scenario without these parts. Mappings and lists that become empty are also removed."""
    remaining = _remove_parts(tree, frozenset(parts), ())
    return remaining if isinstance(remaining, MappingNode) else replace(tree, entries={})


def with_values(tree: MappingNode, values: Mapping[Keys, Node | None]) -> MappingNode:
    """Return the scenario with these values at their keys. Parts with the value None are removed."""
    removed = [keys for keys, value in values.items() if value is None]
    changed = tree
    for keys, value in values.items():
        if value is not None:
            changed = changed.with_value(keys, value, value.position)
    return without_parts(changed, removed) if removed else changed


def find_roundings(tree: MappingNode, digits: int) -> list[Rounding]:
    """Return the roundings of all numbers with more than `digits` significant digits, except in fixed parts."""
    found = []
    for keys, node in nodes_with_keys(tree):
        if isinstance(node, ScalarNode) and keys[0] not in FIXED_KEYS and keys[:2] not in FIXED_WORLD_PARTS:
            rounded = _rounded(node.value, digits)
            if rounded is not None:
                found.append(Rounding(keys, rounded))
    return found


def with_roundings(tree: MappingNode, roundings: Sequence[Rounding]) -> MappingNode:
    """Return the scenario with these rounded numbers."""
    return with_values(tree, {keys: ScalarNode(node_at(tree, keys).position, value) for keys, value in roundings})


def with_seed(tree: MappingNode, seed: int) -> MappingNode:
    """Return the scenario with this seed, without `acceptance`, `expected`, and `variations`."""
    position = key_position(tree, ("seed",))
    changed = tree.without_keys("acceptance", "expected", "variations")
    return changed.with_value(("seed",), ScalarNode(position, seed), position)


def with_only_criterion(tree: MappingNode, kind: str, verdict_id: str, seed: int) -> MappingNode:
    """Return the scenario with this seed, the keys that affect a run, and only the criterion with an id and kind.

    `kind` is e.g. "collisions". If no criterion of this kind has the id, all criteria of the kind are kept. If there is
    no criterion of the kind, all criteria are kept.
    """
    entries = {key: entry for key, entry in tree.entries.items() if key not in UNNEEDED_KEYS}
    criteria = tree.entries.get("pass")
    if kind and criteria is not None and isinstance(criteria.value, SequenceNode):
        items_of_kind = [item for item in criteria.value.items if child(item, kind) is not None]
        items_with_id = [item for item in items_of_kind if (name := child(item, "id")) and name.plain == verdict_id]
        if selected := items_with_id or items_of_kind:
            entries["pass"] = Entry(criteria.key, replace(criteria.value, items=tuple(selected)))
    return with_seed(MappingNode(tree.position, entries), seed)


def with_inline_world(tree: MappingNode, world: MappingNode | None) -> MappingNode | None:
    """Return the scenario with its world inline instead of in a file; None if the world is not in a file."""
    entry = tree.entries.get("world")
    if world is None or entry is None or not isinstance(entry.value, ScalarNode):
        return None
    return MappingNode(tree.position, {**tree.entries, "world": Entry(entry.key, world)})


def removed_parts(before: MappingNode, after: MappingNode) -> list[str]:
    """Return the removed parts as text, e.g. `events[0] (blocker)`. Parts inside a removed part are not listed."""
    remaining = {node.position for _, node in nodes_with_keys(after)}
    found: list[Keys] = []
    for keys, node in nodes_with_keys(before):
        is_inside_found = bool(found) and keys[: len(found[-1])] == found[-1]
        if not is_inside_found and not any(below.position in remaining for _, below in nodes_with_keys(node)):
            found.append(keys)
    return [_part_text(before, keys) for keys in found]


def changed_values(before: MappingNode, after: MappingNode) -> list[str]:
    """Return the changed values as text, e.g. `time_limit: 61.7 s -> 60 s`."""
    scalars = {node.position: (keys, node) for keys, node in nodes_with_keys(before) if isinstance(node, ScalarNode)}
    found = []
    for _, node in nodes_with_keys(after):
        if isinstance(node, ScalarNode) and node.position in scalars:
            keys, old = scalars[node.position]
            if node.value != old.value:
                found.append(f"{dotted_path(keys)}: {old.value} -> {node.value}")
    return found


def _part_text(tree: MappingNode, keys: Keys) -> str:
    """Return the dotted path of a part. For a mapping in a list, add its name, or its first key if it has no name."""
    node, text = node_at(tree, keys), dotted_path(keys)
    if isinstance(node, MappingNode) and isinstance(keys[-1], int):
        named = [
            entry.value.value
            for name in ("name", "id", "sensor", "pose")
            if (entry := node.entries.get(name)) is not None and isinstance(entry.value, ScalarNode)
        ]
        label = named[0] if named else next(iter(node.entries), "")
        return f"{text} ({label})"
    return text


def _remove_parts(node: Node, parts: frozenset[Keys], prefix: Keys) -> Node | None:
    """Return a node without the parts; None for a mapping or list that becomes empty. `prefix` are the node's keys."""
    if isinstance(node, MappingNode):
        entries = {}
        for key, entry in node.entries.items():
            if (*prefix, key) in parts:
                continue
            remaining = _remove_parts(entry.value, parts, (*prefix, key))
            if remaining is not None:
                entries[key] = Entry(entry.key, remaining)
        return replace(node, entries=entries) if entries or not node.entries else None
    if isinstance(node, SequenceNode):
        items = [
            remaining
            for index, item in enumerate(node.items)
            if (*prefix, index) not in parts and (remaining := _remove_parts(item, parts, (*prefix, index))) is not None
        ]
        return replace(node, items=tuple(items)) if items or not node.items else None
    return node


def _rounded(value: object, digits: int) -> str | float | int | None:
    """Return a number or quantity rounded to `digits` significant digits; None if this does not change it."""
    if isinstance(value, bool):
        return None
    if isinstance(value, int | float):
        short = float(f"{value:.{digits}g}")
        return None if short == value else int(short) if isinstance(value, int) else short
    match = NUMBER_AND_UNIT_PATTERN.fullmatch(value) if isinstance(value, str) else None
    if match is None or not any(match[2] in units for units in UNITS.values()):
        return None
    number = float(match[1])
    short = float(f"{number:.{digits}g}")
    return None if short == number else f"{short:g} {match[2]}"
