"""Tree of a YAML file with the positions of its keys and values."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

Scalar = str | int | float | bool | None


class Position(NamedTuple):
    """Position in a file; `line` and `col` count from 1."""

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
    """Position of a key in a mapping, and its value."""

    key: Position
    value: "Node"


@dataclass(frozen=True)
class MappingNode:
    """Mapping, in the order of the file."""

    position: Position
    entries: dict[str, Entry]

    @property
    def plain(self) -> dict[str, Any]:
        """The mapping as a dict of plain Python values."""
        return {key: entry.value.plain for key, entry in self.entries.items()}


Node = ScalarNode | SequenceNode | MappingNode
Key = str | int


def child(node: Node, key: Key) -> Node | None:
    """Return the node under a key or index; None if there is none."""
    if isinstance(node, MappingNode):
        entry = node.entries.get(str(key))
        return entry.value if entry else None
    if isinstance(node, SequenceNode) and isinstance(key, int) and 0 <= key < len(node.items):
        return node.items[key]
    return None


def existing_keys(node: Node, loc: Sequence[Key]) -> tuple[Key, ...]:
    """Return the parts of a pydantic `loc` that exist in the tree; tags of unions do not."""
    return tuple(key for key, _ in _walk(node, loc))


def key_position(node: Node, loc: Sequence[Key]) -> Position:
    """Return the position of the last key of `loc`: a key of a mapping, an item of a sequence, or the node itself."""
    return [node.position, *(position for _, position in _walk(node, loc))][-1]


def value_position(node: Node, loc: Sequence[Key]) -> Position:
    """Return the position of the value at `loc`; of its key if the value is empty."""
    found = node_at(node, loc)
    if isinstance(found, ScalarNode) and found.value is None:
        return key_position(node, loc)
    return found.position


def node_at(node: Node, loc: Sequence[Key]) -> Node:
    """Return the deepest existing node along `loc`."""
    for part in loc:
        node = child(node, part) or node
    return node


def _walk(node: Node, loc: Sequence[Key]) -> Iterator[tuple[Key, Position]]:
    for part in loc:
        below = child(node, part)
        if below is None:
            continue
        yield part, node.entries[str(part)].key if isinstance(node, MappingNode) else below.position
        node = below


def dotted_path(keys: Sequence[Key]) -> str:
    """Return keys as messages show them: `pass[0].goals_reached`."""
    text = "".join(f"[{key}]" if isinstance(key, int) else f".{key}" for key in keys)
    return text.lstrip(".")
