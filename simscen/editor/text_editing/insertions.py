"""Insertion and removal of keys and list items of a YAML text, in the style of the existing entries.

The functions return a Splice, the replacement of a part of the text. In YAML's block style, each entry has its own
line. In flow style, entries are in braces or brackets.
"""

import re
from collections.abc import Sequence
from typing import Any

from simscen.editor.text_editing.splices import EditRefused, Splice, column, line_end, line_start, path_text
from simscen.editor.text_editing.value_text import flow_text, string_text
from simscen.loading.yaml.source_nodes import SourceNode, source_at
from simscen.loading.yaml.tree import Key

INDENT = 2
"""Number of spaces by which nested lines are indented."""
_DASHES = re.compile(r" *(?:- +)*-(?!\S)")
"""Start of a line with list items. Nested lists can begin in the same line, each with a dash."""


def insert_entry(text: str, mapping: SourceNode, key: str, value: Any, order: Sequence[str] = ()) -> Splice:
    """Return the splice that adds a key with a value to a mapping.

    `order` is the preferred order of keys. The key is inserted after the last key of the mapping that precedes it in
    `order`; without such a key, before the first key that follows it in `order`; otherwise, at the end.
    """
    if not mapping.entries:
        return Splice(mapping.start, mapping.end, flow_text({key: value}))
    order = order if key in order else ()
    position = order.index(key) if order else 0
    entries = mapping.entries
    predecessors = [entries[name] for name in order[:position] if name in entries]
    successors = [entries[name] for name in order[position + 1 :] if name in entries]
    pair = f"{string_text(key)}: {flow_text(value)}"
    indent = column(text, next(iter(entries.values())).start)
    is_pair_in_brackets = mapping.is_flow and text[mapping.start] != "{"  # [key: value]
    if successors and not predecessors and not is_pair_in_brackets:
        start = min(entry.start for entry in successors)
        new = f"{pair}, " if mapping.is_flow else f"{_block_entry(key, value, indent)}\n{' ' * indent}"
        return Splice(start, start, new)
    end = max(max(entry.end, entry.value.end) for entry in predecessors or entries.values())
    if is_pair_in_brackets:
        return Splice(mapping.start, end, f"{{{text[mapping.start : end]}, {pair}}}")
    if mapping.is_flow:
        return Splice(end, end, f", {pair}")
    end = line_end(text, end)
    return Splice(end, end, f"\n{' ' * indent}{_block_entry(key, value, indent)}")


def insert_item(text: str, sequence: SourceNode, value: Any, index: int | None = None) -> Splice:
    """Return the splice that inserts an item into a list before the item `index`, or at the end for None."""
    items = sequence.items
    if not items:
        return Splice(sequence.start, sequence.end, f"[{flow_text(value)}]")
    is_at_end = index is None or index >= len(items)
    neighbor = items[-1] if is_at_end else items[index or 0]
    if sequence.is_flow:
        if is_at_end:
            return Splice(neighbor.end, neighbor.end, _separator(text, items) + flow_text(value))
        return Splice(neighbor.start, neighbor.start, f"{flow_text(value)}, ")
    dash = _find_dash(text, neighbor.start)
    indent = column(text, dash)
    item = f"- {_block_value(text, value, neighbor, indent + INDENT)}"
    if is_at_end:
        position = line_end(text, neighbor.end)
        gap = "\n\n" if len(items) > 1 and _has_blank_line(text, items[-2].end, dash) else "\n"
        return Splice(position, position, gap + " " * indent + item)
    position = line_start(text, dash)
    return Splice(position, position, " " * indent + item + "\n")


def _find_dash(text: str, start: int) -> int:
    """Return the index of the dash of the list item whose value begins at `start`.

    Anchors, tags, and comments can be between the dash and the value.
    """
    end = start
    while (match := _DASHES.match(text, line_start(text, end), end)) is None:
        end = line_start(text, end) - 1
        if end < 0:
            raise EditRefused("a list item has no dash at the start of a line; edit the text")
    return match.end() - 1


def _block_entry(key: str, value: Any, indent: int) -> str:
    """Return the text of a new entry of a block mapping. In a list of mappings, each item gets its own line."""
    if isinstance(value, list) and any(isinstance(item, dict) for item in value):
        items = [f"\n{' ' * (indent + INDENT)}- {flow_text(item)}" for item in value]
        return f"{string_text(key)}:{''.join(items)}"
    return f"{string_text(key)}: {flow_text(value)}"


def _block_value(text: str, value: Any, sibling: SourceNode, indent: int) -> str:
    """Return the text of a new list item in the style of another item of the list."""
    if sibling.kind != "mapping" or sibling.is_flow or not isinstance(value, dict) or not value:
        return flow_text(value)
    lines = []
    for key, part in value.items():
        entry = sibling.entries.get(key)
        if entry is not None and not entry.value.is_flow and entry.value.kind == "mapping" and isinstance(part, dict):
            inner = _block_value(text, part, entry.value, indent + INDENT)
            lines.append(f"{string_text(key)}:\n{' ' * (indent + INDENT)}{inner}")
        else:
            lines.append(f"{string_text(key)}: {flow_text(part)}")
    return f"\n{' ' * indent}".join(lines)


def _separator(text: str, items: Sequence[SourceNode]) -> str:
    """Return the text between the last two items, such as a comma and a line break. The default is ", "."""
    between = text[items[-2].end : items[-1].start] if len(items) > 1 else ", "
    return between if between.count(",") == 1 and not between.replace(",", "").strip() else ", "


def _has_blank_line(text: str, start: int, end: int) -> bool:
    return any(not line.strip() for line in text[start:end].split("\n")[1:-1])


def remove_part(text: str, source: SourceNode, keys: tuple[Key, ...]) -> Splice:
    """Return the splice that removes the entry or item at `keys`. `source` is the syntax tree of the text.

    Raises EditRefused if the text does not contain this entry or item.
    """
    parent, node = source_at(source, keys[:-1]), source_at(source, keys)
    if not keys or parent is None or node is None:
        raise EditRefused(f"{path_text(keys)} is not written out in this file; edit the text, or the file that has it")
    if parent.kind == "sequence":
        assert isinstance(keys[-1], int)
        parts = [(item.start, item.end) for item in parent.items]
        if not parent.is_flow:
            dashes = [_find_dash(text, start) for start, _ in parts]
            parts = [(dash, max(end, dash + 1)) for dash, (_, end) in zip(dashes, parts, strict=True)]
        number = keys[-1]
    else:
        parts = [(entry.start, max(entry.end, entry.value.end)) for entry in parent.entries.values()]
        number = list(parent.entries).index(str(keys[-1]))
    if parent.is_flow:
        return _remove_from_flow(text, parent, parts, number)
    if len(parts) == 1:
        empty = "[]" if parent.kind == "sequence" else "{}"
        outer = source_at(source, keys[:-2])
        key_end = outer.entries[str(keys[-2])].end if len(keys) > 1 and outer and outer.kind == "mapping" else 0
        if key_end and text[key_end : parent.start].strip() == ":":
            return Splice(key_end, parent.end, f": {empty}")
        return Splice(parent.start, parent.end, empty)
    return _remove_from_block(text, parts, number)


def _remove_from_flow(text: str, parent: SourceNode, parts: list[tuple[int, int]], number: int) -> Splice:
    """Return the splice that removes the part with index `number` from a flow list or mapping, including a comma.

    `parts` are (start, end) of all parts.
    """
    start, end = parts[number]
    if len(parts) == 1:
        if text[parent.start] not in "[{":  # [key: value]
            return Splice(parent.start, parent.end, "{}")
        return Splice(parent.start + 1, parent.end - 1, "")
    if number == 0:
        return Splice(start, parts[1][0], "")
    return Splice(parts[number - 1][1], end, "")


def _remove_from_block(text: str, parts: list[tuple[int, int]], number: int) -> Splice:
    """Return the splice that removes the part with index `number` from a block list or mapping.

    `parts` are (start, end) of all parts.
    """
    start, end = parts[number]
    begin = line_start(text, start)
    if text[begin:start].strip():
        if number + 1 == len(parts):
            return Splice(parts[number - 1][1], end, "")
        return Splice(start, parts[number + 1][0], "")
    stop = line_end(text, end)
    if stop == len(text) and begin > 0:
        return Splice(begin - 1, stop, "")
    return Splice(begin, min(stop + 1, len(text)), "")
