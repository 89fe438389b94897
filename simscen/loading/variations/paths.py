"""Resolves the paths of varied values, such as `goals[0].pose` or `faults.lidar.noise.std`, to keys of the YAML tree.

A path selects an item of a list by its index from 0 (`[0]` or `.0`), or by its name: the value of `name` or `id`, the
place of a goal, the sensor of a fault, or the kind of a criterion or metric.
"""

import re
from dataclasses import dataclass

from simscen.loading.schema.messages import quoted, short_value, suggestion
from simscen.loading.yaml.tree import (
    Key,
    Keys,
    MappingNode,
    Node,
    Position,
    ScalarNode,
    SequenceNode,
    child,
    dotted_path,
    entries_of,
)

LIST_KEYS = frozenset({"goals", "events", "faults", "pass", "metrics", "tags"})
"""Top-level keys of a scenario that contain lists."""
KEYS_BY_KIND = frozenset({"pass", "metrics"})
"""Top-level keys with lists in which an item can be selected by its kind."""
FIXED_KEYS = {
    "simscen": "all variations use one version of the language",
    "extends": "all variations extend the same file; vary the values that differ",
    "variations": "variations cannot be nested",
    "name": "each variation has its own name",
}
"""Reasons for messages, by top-level key that a variation cannot change."""
_PART_PATTERN = re.compile(r"""\.?(?:([^.\[\]]+)|\["([^"]*)"\]|\['([^']*)'\]|\[([^\]]*)\])""")
"""Pattern of one part of a path: a key, or a key or index in brackets. A dot can precede it."""
_NAME_KEYS = ("name", "id", "sensor", "pose")
"""Keys of an item of a list whose values are names of the item."""


class PathError(ValueError):
    """A path is invalid, or leads to no value. `hint` is the next step for the user."""

    def __init__(self, message: str, hint: str = "") -> None:
        super().__init__(message)
        self.hint = hint


@dataclass(frozen=True)
class Target:
    """Value that a variation changes: its path, the position of the path in the file, and the keys to the value."""

    path: str
    position: Position
    keys: Keys


def resolve_path(path: str, position: Position, tree: MappingNode) -> Target:
    """Return the target of a path in the scenario `tree`. `position` is the position of the path in the file.

    A path can lead to keys that the scenario does not have yet. Raises PathError for a missing item of a list, an
    invalid path, and a key that a variation cannot change.
    """
    parts = split_path(path)
    if parts[0] in FIXED_KEYS:
        raise PathError(f"a variation cannot change `{parts[0]}`", FIXED_KEYS[parts[0]])
    return Target(path, position, _resolve_keys(path, parts, tree))


def split_path(path: str) -> list[str]:
    """Return the parts of a path without dots and brackets. Raises PathError for an invalid path."""
    parts, position = [], 0
    while position < len(path):
        match = _PART_PATTERN.match(path, position)
        part = match and next((group for group in match.groups() if group is not None), "").strip()
        if not match or not part or (position == 0 and path.startswith(".")):
            raise PathError(f"{quoted(path)} is not a valid path", "join keys with dots, e.g. `goals[0].pose.x`")
        parts.append(part)
        position = match.end()
    if not parts:
        raise PathError(f"{quoted(path)} is not a valid path", "join keys with dots, e.g. `goals[0].pose.x`")
    return parts


def _resolve_keys(path: str, parts: list[str], tree: MappingNode) -> Keys:
    """Return the keys of the value at a path with these parts. Raises PathError if the path leads nowhere."""
    node: Node | None = tree
    keys: list[Key] = []
    for number, part in enumerate(parts):
        match node:
            case MappingNode():
                keys.append(part)
                node = node.entries[part].value if part in node.entries else None
            case SequenceNode():
                found = _item_keys(path, keys, node, part, parts[number + 1 :])
                keys += found
                for key in found:
                    node = child(node, key)
            case ScalarNode(value=value):
                written = "empty" if value is None else short_value(node)
                message = f"{quoted(path)} leads to nothing: `{dotted_path(keys)}` is {written}, without a `{part}`"
                raise PathError(message, _scalar_hint(keys))
            case None:
                if keys[-1] in LIST_KEYS and len(keys) == 1:
                    raise PathError(f"{quoted(path)} leads to nothing: the scenario has no `{keys[-1]}`")
                keys.append(part)
    return tuple(keys)


def _item_keys(path: str, keys: list[Key], items: SequenceNode, part: str, next_parts: list[str]) -> list[Key]:
    """Return the keys that `part` of a path selects in the list `items` at `keys`: [index], or [index, kind].

    The kind of a criterion or metric follows if the path continues with a key of the kind: `pass.clearance.min` leads
    to `pass[0].clearance.min`, but `pass.clearance.severity` to `pass[0].severity`. `next_parts` are the parts of the
    path after `part`. Raises PathError if no item or several items match.
    """
    holder = dotted_path(keys)
    if part.isascii() and part.isdecimal():
        if int(part) >= len(items.items):
            count = f"{len(items.items)} item{'' if len(items.items) == 1 else 's'}"
            raise PathError(f"{quoted(path)} leads to nothing: `{holder}` has {count}", "the first item is [0]")
        return [int(part)]
    matches = [index for index, item in enumerate(items.items) if part in _item_names(item)]
    if len(matches) > 1 and next_parts:
        matches = [index for index in matches if child(items.items[index], next_parts[0]) is not None] or matches
    kinds = [
        index
        for index, item in enumerate(items.items)
        if keys and keys[0] in KEYS_BY_KIND and not matches and child(item, part) is not None
    ]
    found = matches or kinds
    if len(found) > 1:
        hint = f"use the index: {', '.join(f'{holder}[{index}]' for index in found[:5])}"
        message = f"{quoted(path)} is ambiguous: {len(found)} items of `{holder}` are called {quoted(part)}"
        raise PathError(message, hint)
    if not found:
        known = [name for item in items.items for name in _item_names(item)]
        if keys[0] in KEYS_BY_KIND:
            known += [key for item in items.items for key in entries_of(item) if key != "id"]
        hint = suggestion(part, known) if known else "use the index; the first item is [0]"
        raise PathError(f"{quoted(path)} leads to nothing: no item of `{holder}` is called {quoted(part)}", hint)
    if kinds and not (next_parts and next_parts[0] in ("id", "severity", "then", part)):
        return [kinds[0], part]
    return [found[0]]


def _item_names(item: Node) -> list[str]:
    """Return the names of an item of a list. A text is its own name."""
    if isinstance(item, ScalarNode):
        return [item.value] if isinstance(item.value, str) else []
    values = [child(item, key) for key in _NAME_KEYS]
    return [value.value for value in values if isinstance(value, ScalarNode) and isinstance(value.value, str)]


def _scalar_hint(keys: list[Key]) -> str:
    """Return the hint for a path that leads into the name of a file or place at `keys`; "" for other scalars."""
    if keys in (["world"], ["map"], ["robot", "model"]):
        alternative = ", or write the world inline" if keys == ["world"] else ""
        return f"values in another file cannot be varied; vary the file name itself{alternative}"
    if keys[-1] == "pose":
        return f"vary {quoted(dotted_path(keys))} as a whole, or write it as `{{x: …, y: …, yaw: …}}`"
    return ""
