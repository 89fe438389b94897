"""Tree of a YAML file with the positions of keys and values, and functions that search or change such a tree.

Trees are immutable. A `loc` is the location of a validation error in pydantic: keys and list indices, with tags of
union members between them. Functions with a `loc` skip parts that do not exist in the tree, such as tags.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

Scalar = str | int | float | bool | None


class Position(NamedTuple):
    """Position in a file. `path` is the path in messages, usually relative to the root.

    `line` and `col` (column) count from 1; they are 0 for the whole file.
    """

    path: str
    line: int
    col: int


@dataclass(frozen=True)
class ScalarNode:
    """Scalar value."""

    position: Position
    value: Scalar

    @property
    def plain(self) -> Scalar:
        """The value."""
        return self.value


@dataclass(frozen=True)
class SequenceNode:
    """Sequence of nodes."""

    position: Position
    items: tuple["Node", ...]

    @property
    def plain(self) -> list[Any]:
        """The sequence as a list of plain Python values."""
        return [item.plain for item in self.items]


@dataclass(frozen=True)
class Entry:
    """Entry of a mapping: the position of the key (`key`), and the value."""

    key: Position
    value: "Node"


@dataclass(frozen=True)
class MappingNode:
    """Mapping from keys to entries, in the order of the file."""

    position: Position
    entries: dict[str, Entry]

    @property
    def plain(self) -> dict[str, Any]:
        """The mapping as a dict of plain Python values."""
        return {key: entry.value.plain for key, entry in self.entries.items()}

    def without_keys(self, *keys: str) -> "MappingNode":
        """Return the mapping without these keys."""
        return MappingNode(self.position, {key: entry for key, entry in self.entries.items() if key not in keys})

    def with_value(self, keys: "Keys", value: "Node", position: Position) -> "MappingNode":
        """Return a copy with `value` at `keys`, at least one key. Added keys and mappings get `position`."""
        changed = _with_value(self, keys, value, position)
        assert isinstance(changed, MappingNode)
        return changed


Node = ScalarNode | SequenceNode | MappingNode
Key = str | int
"""Key of a mapping, or index of an item in a sequence, from 0."""
Keys = tuple[Key, ...]
"""Keys and indices that lead from the top of a file to a value, e.g. ("goals", 0, "pose")."""


def child(node: Node | None, key: Key) -> Node | None:
    """Return the node under a key or index; None if there is none."""
    if isinstance(node, MappingNode):
        entry = node.entries.get(str(key))
        return entry.value if entry else None
    if isinstance(node, SequenceNode) and isinstance(key, int) and 0 <= key < len(node.items):
        return node.items[key]
    return None


def entries_of(node: Node | None) -> dict[str, Entry]:
    """Return the entries of a mapping; {} for other nodes."""
    return node.entries if isinstance(node, MappingNode) else {}


def items_of(node: Node | None) -> tuple[Node, ...]:
    """Return the items of a sequence; () for other nodes."""
    return node.items if isinstance(node, SequenceNode) else ()


def nodes_with_keys(node: Node, keys: Keys = ()) -> Iterator[tuple[Keys, Node]]:
    """Yield a node and all nodes below it with their keys, in the order of the file. `keys` are the keys of `node`."""
    yield keys, node
    for key, entry in entries_of(node).items():
        yield from nodes_with_keys(entry.value, (*keys, key))
    for index, item in enumerate(items_of(node)):
        yield from nodes_with_keys(item, (*keys, index))


def _with_value(node: Node | None, keys: Keys, value: Node, position: Position) -> Node:
    """Return a copy of a tree with `value` at `keys`. Mappings replace scalars and missing nodes on the way."""
    if not keys:
        return value
    key, next_keys = keys[0], keys[1:]
    if isinstance(node, SequenceNode) and isinstance(key, int):
        items = list(node.items)
        items[key] = _with_value(items[key], next_keys, value, position)
        return SequenceNode(node.position, tuple(items))
    mapping = node if isinstance(node, MappingNode) else MappingNode(position, {})
    old = mapping.entries.get(str(key))
    entry = Entry(old.key if old else position, _with_value(old.value if old else None, next_keys, value, position))
    return MappingNode(mapping.position, {**mapping.entries, str(key): entry})


def existing_keys(node: Node, loc: Sequence[Key]) -> Keys:
    """Return the parts of `loc` that exist in the tree."""
    return tuple(key for key, _ in _existing(node, loc))


def key_position(node: Node, loc: Sequence[Key]) -> Position:
    """Return the position of the last key or item in `loc` that exists; the position of `node` if none exists."""
    return [node.position, *(position for _, position in _existing(node, loc))][-1]


def value_position(node: Node, loc: Sequence[Key]) -> Position:
    """Return the position of the value at `loc`. An empty value has the position of its key."""
    found = node_at(node, loc)
    if isinstance(found, ScalarNode) and found.value is None:
        return key_position(node, loc)
    return found.position


def node_at(node: Node, loc: Sequence[Key]) -> Node:
    """Return the node at `loc`. Parts of `loc` that do not exist are skipped."""
    for part in loc:
        node = child(node, part) or node
    return node


def _existing(node: Node, loc: Sequence[Key]) -> Iterator[tuple[Key, Position]]:
    """Yield the parts of `loc` that exist in the tree, with the positions of the keys or items."""
    for part in loc:
        below = child(node, part)
        if below is None:
            continue
        yield part, node.entries[str(part)].key if isinstance(node, MappingNode) else below.position
        node = below


def dotted_path(keys: Sequence[Key]) -> str:
    """Return keys as text for messages, e.g. `pass[0].goals_reached`."""
    text = "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in keys)
    return text.lstrip(".")
