"""How a variation says which value it means: `robot.pose.x`, `goals[0].pose`, `faults.lidar.noise.std`.

Parts are joined by dots. An item of a list is said by its number from 0 on, `[0]` or `.0`, or by what it is called:
its `name` or `id`, the place of a goal, the sensor of a fault, the kind of a criterion.
"""

import re
from dataclasses import dataclass

from simscen.loading.schema.messages import quoted, short_value, suggestion
from simscen.loading.yaml.tree import Entry, Key, MappingNode, Node, Position, ScalarNode, SequenceNode, dotted_path

LIST_KEYS = frozenset({"goals", "events", "faults", "pass", "metrics", "tags"})
"""The keys of a scenario that hold lists."""
KEYS_BY_KIND = frozenset({"pass", "metrics"})
"""Those of them whose items may be called by the one key that they are about."""
FIXED_KEYS = {
    "simscen": "all variations are of one language",
    "extends": "all variations are of one file; vary the values that differ",
    "variations": "variations have no variations",
    "name": "each variation has a name of its own",
}
"""What a variation cannot change, and why."""
_PART = re.compile(r"""\.?(?:([^.\[\]]+)|\["([^"]*)"\]|\['([^']*)'\]|\[([^\]]*)\])""")
_NAMES = ("name", "id", "sensor", "pose")


class PathError(ValueError):
    """It names nothing; `hint` helps."""

    def __init__(self, message: str, hint: str = "") -> None:
        super().__init__(message)
        self.hint = hint


@dataclass(frozen=True)
class Target:
    """A value of a scenario: the path as it is written, where that stands, and the keys that lead there."""

    path: str
    place: Position
    keys: tuple[Key, ...]


def resolve_path(path: str, place: Position, tree: MappingNode) -> Target:
    """What a path means in a scenario, also where nothing is written there yet. Raises NoPath."""
    parts = split_path(path)
    if parts[0] in FIXED_KEYS:
        raise PathError(f"a variation cannot change `{parts[0]}`", FIXED_KEYS[parts[0]])
    return Target(path, place, _keys(path, parts, tree))


def set_value(tree: MappingNode, target: Target, value: Node) -> MappingNode:
    """The scenario with the value there. What was not there stands where the path does, for messages about it."""
    changed = _put(tree, target.keys, value, target.place)
    assert isinstance(changed, MappingNode)
    return changed


def split_path(path: str) -> list[str]:
    """What stands between the dots and in the brackets of a path. Raises NoPath."""
    parts, position = [], 0
    while position < len(path):
        match = _PART.match(path, position)
        part = match and next((group for group in match.groups() if group is not None), "").strip()
        if not match or not part or (position == 0 and path.startswith(".")):
            raise PathError(f"{quoted(path)} is no path", "write keys with dots between them, e.g. `goals[0].pose.x`")
        parts.append(part)
        position = match.end()
    if not parts:
        raise PathError(f"{quoted(path)} is no path", "write keys with dots between them, e.g. `goals[0].pose.x`")
    return parts


def _keys(path: str, parts: list[str], tree: MappingNode) -> tuple[Key, ...]:
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
                    node = (
                        node.items[key]
                        if isinstance(node, SequenceNode) and isinstance(key, int)
                        else _child(node, key)
                    )
            case ScalarNode():
                raise PathError(
                    f"{quoted(path)} names nothing: `{dotted_path(keys)}` is {_told(node)}, without a `{part}`",
                    _file_hint(keys),
                )
            case None:
                if keys[-1] in LIST_KEYS and len(keys) == 1:
                    raise PathError(f"{quoted(path)} names nothing: the scenario has no `{keys[-1]}`")
                keys.append(part)
    return tuple(keys)


def _item(path: str, keys: list[Key], items: SequenceNode, part: str, rest: list[str]) -> list[Key]:
    """The keys of an item of a list; of one that is called by its kind, also that kind."""
    holder = dotted_path(keys)
    if part.isdecimal():
        if int(part) >= len(items.items):
            count = f"{len(items.items)} item{'' if len(items.items) == 1 else 's'}"
            raise PathError(f"{quoted(path)} names nothing: `{holder}` has {count}", "the first one is [0]")
        return [int(part)]
    called = [index for index, item in enumerate(items.items) if part in _names(item)]
    if len(called) > 1 and rest:
        called = [index for index in called if _child(items.items[index], rest[0]) is not None] or called
    kinds = [
        index
        for index, item in enumerate(items.items)
        if keys and keys[0] in KEYS_BY_KIND and not called and _child(item, part) is not None
    ]
    found = called or kinds
    if len(found) > 1:
        hint = f"say which one by its number: {', '.join(f'{holder}[{index}]' for index in found[:5])}"
        raise PathError(
            f"{quoted(path)} names several: {len(found)} items of `{holder}` are called {quoted(part)}", hint
        )
    if not found:
        known = [name for item in items.items for name in _names(item)]
        if keys[0] in KEYS_BY_KIND:
            known += [
                key for item in items.items if isinstance(item, MappingNode) for key in item.entries if key != "id"
            ]
        hint = suggestion(part, known) if known else "say it by its number, [0] is the first"
        raise PathError(f"{quoted(path)} names nothing: no item of `{holder}` is called {quoted(part)}", hint)
    if kinds and not (rest and rest[0] in ("id", "severity", "then", part)):
        return [kinds[0], part]
    return [found[0]]


def _names(item: Node) -> list[str]:
    if isinstance(item, ScalarNode):
        return [item.value] if isinstance(item.value, str) else []
    if not isinstance(item, MappingNode):
        return []
    values = [item.entries[key].value for key in _NAMES if key in item.entries]
    return [value.value for value in values if isinstance(value, ScalarNode) and isinstance(value.value, str)]


def _child(node: Node | None, key: Key) -> Node | None:
    entry = node.entries.get(str(key)) if isinstance(node, MappingNode) else None
    return entry.value if entry else None


def _told(leaf: ScalarNode) -> str:
    return short_value(leaf) if leaf.value is not None else "empty"


def _file_hint(keys: list[Key]) -> str:
    if keys in (["world"], ["map"], ["robot", "model"]):
        what = "name other files by the path of this key" + (", or write the world inline" if keys == ["world"] else "")
        return f"values in another file cannot be varied; {what}"
    if keys[-1] == "pose":
        return f"vary {quoted(dotted_path(keys))} as a whole, or write it as `{{x: …, y: …, yaw: …}}`"
    return ""


def _put(node: Node | None, keys: tuple[Key, ...], value: Node, place: Position) -> Node:
    if not keys:
        return value
    first, *rest = keys
    if isinstance(node, SequenceNode) and isinstance(first, int):
        items = list(node.items)
        items[first] = _put(items[first], tuple(rest), value, place)
        return SequenceNode(node.place, tuple(items))
    fields = node if isinstance(node, MappingNode) else MappingNode(place, {})
    below = fields.entries.get(str(first))
    entry = Entry(below.key if below else place, _put(below.value if below else None, tuple(rest), value, place))
    return MappingNode(fields.place, {**fields.entries, str(first): entry})
