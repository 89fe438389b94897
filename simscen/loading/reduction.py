"""Reduction of a scenario: parts that can be left out, numbers that can be rounded, and the result as YAML."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import yaml

from simscen.loading.yaml.parser import parse_yaml
from simscen.loading.yaml.scalars import Dumper, to_yaml
from simscen.loading.yaml.tree import (
    Entry,
    Key,
    MappingNode,
    Node,
    Position,
    ScalarNode,
    SequenceNode,
    dotted_path,
    node_at,
)
from simscen.spec.quantities import NUMBER_AND_UNIT

Keys = tuple[Key, ...]
"""Keys from the top of a scenario to a part of it."""
REQUIRED_KEYS = frozenset({"simscen", "world", "robot", "robots", "seed", "pass", "time_limit"})
"""Top-level keys that are never left out as a whole."""
FIXED_KEYS = frozenset({"simscen", "seed", "pass", "time_limit"})
"""Top-level keys of which no part is left out or simplified: they define the failure and the length of the run."""
FIXED_WORLD_PARTS = frozenset({("world", "walls"), ("world", "map"), ("world", "sdf")})
"""Parts of a world that are never left out: without them, the same criterion would fail for another reason."""
UNNEEDED_KEYS = frozenset({"acceptance", "description", "expected", "metrics", "skip", "tags", "variations"})
"""Top-level keys that no minimal scenario needs."""
MAX_DIGITS = 3


class Rounding(NamedTuple):
    """A number in a scenario, and a simpler value of it."""

    keys: Keys
    value: str | float | int


def removable_parts(tree: MappingNode, depth: int) -> list[Keys]:
    """Return the parts that can be left out and whose paths have `depth` keys, in the order of the file."""
    return [
        keys
        for keys, _ in _parts(tree)
        if len(keys) == depth
        and keys[0] not in FIXED_KEYS
        and keys[:2] not in FIXED_WORLD_PARTS
        and not (depth == 1 and keys[0] in REQUIRED_KEYS)
    ]


def max_depth(tree: MappingNode) -> int:
    """Return the largest number of keys in the path of a part."""
    return max(len(keys) for keys, _ in _parts(tree))


def without_parts(tree: MappingNode, parts: Collection[Keys]) -> MappingNode:
    """Return the scenario without these parts. Mappings and lists that become empty are left out, too."""
    remaining = _remove_parts(tree, frozenset(parts), ())
    return remaining if isinstance(remaining, MappingNode) else replace(tree, entries={})


def with_values(tree: MappingNode, values: Mapping[Keys, Node | None]) -> MappingNode:
    """Return the scenario with other values at these keys; None leaves the part out."""
    removed = [keys for keys, value in values.items() if value is None]
    changed = tree
    for keys, value in values.items():
        if value is not None:
            result = _with_value(changed, keys, value)
            assert isinstance(result, MappingNode)
            changed = result
    return without_parts(changed, removed) if removed else changed


def roundings(tree: MappingNode, digits: int) -> list[Rounding]:
    """Return the numbers that become simpler when they are rounded to `digits` significant digits."""
    found = []
    for keys, node in _parts(tree):
        if isinstance(node, ScalarNode) and keys[0] not in FIXED_KEYS and keys[:2] not in FIXED_WORLD_PARTS:
            rounded = _rounded(node.value, digits)
            if rounded is not None:
                found.append(Rounding(keys, rounded))
    return found


def rounded_tree(tree: MappingNode, changes: Sequence[Rounding]) -> MappingNode:
    """Return the scenario with these rounded numbers."""
    return with_values(
        tree, {change.keys: ScalarNode(node_at(tree, change.keys).position, change.value) for change in changes}
    )


def with_seed(tree: MappingNode, seed: int) -> MappingNode:
    """Return the scenario with this seed, without keys that `simscen run` does not need for a single run."""
    entries = {key: entry for key, entry in tree.entries.items() if key not in ("acceptance", "expected", "variations")}
    position = entries["seed"].key if "seed" in entries else tree.position
    entries["seed"] = Entry(position, ScalarNode(position, seed))
    return replace(tree, entries=entries)


def removed_parts(before: MappingNode, after: MappingNode) -> list[str]:
    """Return the parts of a scenario that a reduced version lacks; a removed part is listed without its own parts."""
    remaining = {node.position for _, node in _parts(after)}
    found: list[Keys] = []
    for keys, node in _parts(before):
        is_part_of_found = bool(found) and keys[: len(found[-1])] == found[-1]
        if not is_part_of_found and not any(
            each.position in remaining for each in (node, *(n for _, n in _parts(node)))
        ):
            found.append(keys)
    return [part_text(before, keys) for keys in found]


def changed_values(before: MappingNode, after: MappingNode) -> list[str]:
    """Return the values that differ in a reduced version of a scenario: `time_limit: 61.7 s -> 60 s`."""
    values = {node.position: (keys, node.value) for keys, node in _parts(before) if isinstance(node, ScalarNode)}
    return [
        f"{dotted_path(values[node.position][0])}: {values[node.position][1]} -> {node.value}"
        for _, node in _parts(after)
        if isinstance(node, ScalarNode) and node.position in values and node.value != values[node.position][1]
    ]


def part_text(tree: MappingNode, keys: Keys) -> str:
    """Return a part as messages show it: its keys, and its name or type if it has one."""
    node: Node | None = tree
    for key in keys:
        node = _child(node, key)
    text = dotted_path(keys)
    if isinstance(node, MappingNode) and isinstance(keys[-1], int):
        named = [
            entry.value.value
            for name in ("name", "id", "sensor", "pose")
            if (entry := node.entries.get(name)) is not None and isinstance(entry.value, ScalarNode)
        ]
        label = named[0] if named else next(iter(node.entries), "")
        return f"{text} ({label})"
    return text


def _parts(node: Node, prefix: Keys = ()) -> Iterator[tuple[Keys, Node]]:
    if prefix:
        yield prefix, node
    if isinstance(node, MappingNode):
        for key, entry in node.entries.items():
            yield from _parts(entry.value, (*prefix, key))
    elif isinstance(node, SequenceNode):
        for index, item in enumerate(node.items):
            yield from _parts(item, (*prefix, index))


def _child(node: Node | None, key: Key) -> Node | None:
    if isinstance(node, MappingNode):
        entry = node.entries.get(str(key))
        return None if entry is None else entry.value
    if isinstance(node, SequenceNode) and isinstance(key, int) and key < len(node.items):
        return node.items[key]
    return None


def _remove_parts(node: Node, parts: frozenset[Keys], prefix: Keys) -> Node | None:
    """Return the node without the parts, None if nothing of a mapping or list is left."""
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


def _with_value(node: Node | None, keys: Keys, value: Node) -> Node:
    if not keys:
        return value
    key, rest = keys[0], keys[1:]
    if isinstance(node, SequenceNode) and isinstance(key, int):
        items = list(node.items)
        items[key] = _with_value(items[key], rest, value)
        return replace(node, items=tuple(items))
    owner = node if isinstance(node, MappingNode) else MappingNode(value.position, {})
    below = owner.entries.get(str(key))
    position: Position = below.key if below is not None else value.position
    entry = Entry(position, _with_value(below.value if below is not None else None, rest, value))
    return replace(owner, entries={**owner.entries, str(key): entry})


def _rounded(value: object, digits: int) -> str | float | int | None:
    """Return a number or quantity with `digits` significant digits, None if that changes nothing."""
    if isinstance(value, bool):
        return None
    if isinstance(value, int | float):
        short = float(f"{value:.{digits}g}")
        return None if short == value else int(short) if isinstance(value, int) else short
    match = NUMBER_AND_UNIT.fullmatch(value) if isinstance(value, str) else None
    if match is None:
        return None
    number = float(match[1])
    short = float(f"{number:.{digits}g}")
    return None if short == number else f"{short:g} {match[2]}"


LINE_WIDTH = 100


def changed_text(text: str, path: str, content: Mapping[str, Any], comment: str = "") -> str:
    """Return `content` as YAML. Top-level keys and list items that are the same in `text` keep their lines.

    `path` is the file name in the positions of errors. `comment` is put at the top, with `# ` before each of its lines.
    """
    original, _ = parse_yaml(text, path)
    lines = text.splitlines()
    known = original.plain if isinstance(original, MappingNode) else {}
    segments = _segments(original, lines) if isinstance(original, MappingNode) else {}
    head = "".join(f"# {line}\n" for line in comment.splitlines())
    parts = [head]
    for key, value in content.items():
        if key in segments and known.get(key) == value:
            parts.append(_block(segments[key]))
        elif isinstance(original, MappingNode) and key in segments and isinstance(value, list):
            parts.append(_list_text(key, value, original, lines, segments[key]))
        else:
            parts.append(_dumped({key: value}))
    whole = "".join(parts)
    written, problems = parse_yaml(whole, path)
    if problems or written is None or written.plain != content:  # for example anchors that other lines refer to
        return head + to_yaml(content)
    return whole


def _segments(original: MappingNode, lines: Sequence[str]) -> dict[str, list[str]]:
    """Return the lines of each top-level key, with the comments directly above it."""
    keys = sorted(original.entries, key=lambda key: original.entries[key].key.line)
    if any(original.entries[key].key.col != 1 for key in keys):
        return {}  # in braces
    starts = [_with_comments(original.entries[key].key.line - 1, lines) for key in keys]
    ends = [*starts[1:], len(lines)]
    return {key: list(lines[start:end]) for key, start, end in zip(keys, starts, ends, strict=True)}


def _with_comments(start: int, lines: Sequence[str]) -> int:
    """Return the index of the first comment line directly above a line, or that line."""
    while start > 0 and lines[start - 1].lstrip().startswith("#"):
        start -= 1
    return start


def _list_text(key: str, value: list[Any], original: MappingNode, lines: Sequence[str], segment: Sequence[str]) -> str:
    """Return a list whose unchanged items keep their lines."""
    node = original.entries[key].value
    start = original.entries[key].key.line - 1
    if not isinstance(node, SequenceNode) or not value or not node.items:
        return _dumped({key: value})
    first_lines = [item.position.line - 1 for item in node.items]
    on_own_lines = all(lines[line].lstrip().startswith("- ") for line in first_lines) and len(set(first_lines)) == len(
        first_lines
    )
    if not on_own_lines or first_lines[0] == start:
        return _dumped({key: value})
    starts = [_with_comments(line, lines) for line in first_lines]
    end = _with_comments(start, lines) + len(segment)
    ends = [*starts[1:], end]
    indent = len(lines[first_lines[0]]) - len(lines[first_lines[0]].lstrip())
    texts = [_block(lines[first:last]) for first, last in zip(starts, ends, strict=True)]
    head = _block(lines[_with_comments(start, lines) : starts[0]])
    parts, rest = [], list(zip((item.plain for item in node.items), texts, strict=True))
    for item in value:
        same = next((index for index, (plain, _) in enumerate(rest) if plain == item), None)
        if same is None:
            parts.append(_indented(_dumped([item]), indent))
        else:
            parts.append(rest[same][1])
            rest = rest[same + 1 :]
    return head + "".join(parts)


def _block(lines: Sequence[str]) -> str:
    """Return lines as text, without blank lines at the end."""
    trimmed = list(lines)
    while trimmed and not trimmed[-1].strip():
        trimmed.pop()
    return "".join(f"{line}\n" for line in trimmed)


def _indented(text: str, columns: int) -> str:
    return "".join(f"{' ' * columns}{line}\n" for line in text.splitlines())


def _dumped(data: Any) -> str:
    """Return YAML in which only the innermost mappings and lists are in braces and brackets."""
    if isinstance(data, dict):
        return "".join(_entry(key, value) for key, value in data.items())
    return _flow(data)


def _entry(key: str, value: Any) -> str:
    """Return a top-level key with its value, on the same line if that is short."""
    text = _flow({key: value})
    is_braced = text.startswith("{")
    return f"{text.strip()[1:-1]}\n" if is_braced else text


def _flow(data: Any) -> str:
    text: str = yaml.dump(
        data, Dumper=Dumper, sort_keys=False, allow_unicode=True, width=LINE_WIDTH, default_flow_style=None
    )
    return text
