"""Resolve paths to the values that a variation changes: `robot.pose.x`, `goals[0].pose`, `faults.lidar.noise.std`.

The parts of a path are joined by dots. An item of a list is given by its index from 0, as `[0]` or `.0`, or by a name:
its `name` or `id`, the place of a goal, the sensor of a fault, or the kind of a criterion or metric.
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
    replace_at,
)

LIST_KEYS = frozenset({"goals", "events", "faults", "pass", "metrics", "tags"})
"""Top-level keys of a scenario that contain lists."""
KEYS_BY_KIND = frozenset({"pass", "metrics"})
"""Top-level keys with lists whose items may be given by their kind."""
FIXED_KEYS = {
    "simscen": "all variations use one version of the language",
    "extends": "all variations extend the same file; vary the values that differ",
    "variations": "variations cannot be nested",
    "name": "each variation has its own name",
}
"""Keys that a variation cannot change, and the reason."""
_PART = re.compile(r"""\.?(?:([^.\[\]]+)|\["([^"]*)"\]|\['([^']*)'\]|\[([^\]]*)\])""")
"""One part of a path: a key, or a key or an index in brackets; a dot before it is skipped."""
_NAME_KEYS = ("name", "id", "sensor", "pose")
"""Keys whose texts can name an item of a list."""


class PathError(ValueError):
    """Error for a path that is invalid, or leads to no value; `hint` says what to do."""

    def __init__(self, message: str, hint: str = "") -> None:
        super().__init__(message)
        self.hint = hint


@dataclass(frozen=True)
class Target:
    """Value that a variation changes: the path as written, the position of the path, and the keys of the value."""

    path: str
    position: Position
    keys: Keys


def resolve_path(path: str, position: Position, tree: MappingNode) -> Target:
    """Return the target of a path that is written at `position`. Raises PathError.

    The value need not exist in the scenario: missing keys of mappings are allowed, missing items of lists are not.
    """
    parts = split_path(path)
    if parts[0] in FIXED_KEYS:
        raise PathError(f"a variation cannot change `{parts[0]}`", FIXED_KEYS[parts[0]])
    return Target(path, position, _keys(path, parts, tree))


def set_value(tree: MappingNode, target: Target, value: Node) -> MappingNode:
    """Return the scenario with `value` at the target. New mappings and keys have the position of the path."""
    changed = replace_at(tree, target.keys, value, target.position)
    assert isinstance(changed, MappingNode)
    return changed


def split_path(path: str) -> list[str]:
    """Return the parts of a path, without dots and brackets. Raises PathError for a path that is not valid."""
    parts, position = [], 0
    while position < len(path):
        match = _PART.match(path, position)
        part = match and next((group for group in match.groups() if group is not None), "").strip()
        if not match or not part or (position == 0 and path.startswith(".")):
            raise PathError(f"{quoted(path)} is not a valid path", "join keys with dots, e.g. `goals[0].pose.x`")
        parts.append(part)
        position = match.end()
    if not parts:
        raise PathError(f"{quoted(path)} is not a valid path", "join keys with dots, e.g. `goals[0].pose.x`")
    return parts


def _keys(path: str, parts: list[str], tree: MappingNode) -> Keys:
    """Return the keys of the value to which the parts of a path lead. Raises PathError if they lead nowhere."""
    node: Node | None = tree
    keys: list[Key] = []
    for number, part in enumerate(parts):
        match node:
            case MappingNode():
                keys.append(part)
                node = node.entries[part].value if part in node.entries else None
            case SequenceNode():
                found = _item(path, keys, node, part, parts[number + 1 :])
                keys += found
                for key in found:
                    node = child(node, key)
            case ScalarNode():
                raise PathError(
                    f"{quoted(path)} leads to nothing: `{dotted_path(keys)}` is {_describe(node)}, without a `{part}`",
                    _scalar_hint(keys),
                )
            case None:
                if keys[-1] in LIST_KEYS and len(keys) == 1:
                    raise PathError(f"{quoted(path)} leads to nothing: the scenario has no `{keys[-1]}`")
                keys.append(part)
    return tuple(keys)


def _item(path: str, keys: list[Key], items: SequenceNode, part: str, rest: list[str]) -> list[Key]:
    """Return the index of the item that `part` gives in the list at `keys`; then the kind, if `part` is a kind.

    `rest` are the parts of the path after it. Raises PathError if there is no such item, or several.
    """
    holder = dotted_path(keys)
    if part.isascii() and part.isdecimal():
        if int(part) >= len(items.items):
            count = f"{len(items.items)} item{'' if len(items.items) == 1 else 's'}"
            raise PathError(f"{quoted(path)} leads to nothing: `{holder}` has {count}", "the first item is [0]")
        return [int(part)]
    matches = [index for index, item in enumerate(items.items) if part in _names(item)]
    if len(matches) > 1 and rest:
        matches = [index for index in matches if child(items.items[index], rest[0]) is not None] or matches
    kinds = [
        index
        for index, item in enumerate(items.items)
        if keys and keys[0] in KEYS_BY_KIND and not matches and child(item, part) is not None
    ]
    found = matches or kinds
    if len(found) > 1:
        hint = f"use the index: {', '.join(f'{holder}[{index}]' for index in found[:5])}"
        raise PathError(
            f"{quoted(path)} is ambiguous: {len(found)} items of `{holder}` are called {quoted(part)}", hint
        )
    if not found:
        known = [name for item in items.items for name in _names(item)]
        if keys[0] in KEYS_BY_KIND:
            known += [
                key for item in items.items if isinstance(item, MappingNode) for key in item.entries if key != "id"
            ]
        hint = suggestion(part, known) if known else "use the index; the first item is [0]"
        raise PathError(f"{quoted(path)} leads to nothing: no item of `{holder}` is called {quoted(part)}", hint)
    if kinds and not (rest and rest[0] in ("id", "severity", "then", part)):
        return [kinds[0], part]
    return [found[0]]


def _names(item: Node) -> list[str]:
    """Return the names of an item of a list; the name of a text is the text itself."""
    if isinstance(item, ScalarNode):
        return [item.value] if isinstance(item.value, str) else []
    if not isinstance(item, MappingNode):
        return []
    values = [item.entries[key].value for key in _NAME_KEYS if key in item.entries]
    return [value.value for value in values if isinstance(value, ScalarNode) and isinstance(value.value, str)]


def _describe(leaf: ScalarNode) -> str:
    return short_value(leaf) if leaf.value is not None else "empty"


def _scalar_hint(keys: list[Key]) -> str:
    """Return what to do if a path leads into the scalar at `keys`, which names a file or a place; else ""."""
    if keys in (["world"], ["map"], ["robot", "model"]):
        what = "name other files by the path of this key" + (", or write the world inline" if keys == ["world"] else "")
        return f"values in another file cannot be varied; {what}"
    if keys[-1] == "pose":
        return f"vary {quoted(dotted_path(keys))} as a whole, or write it as `{{x: …, y: …, yaw: …}}`"
    return ""
