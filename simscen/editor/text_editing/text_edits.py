"""Edits of a YAML text that set a value, insert a list item, or remove a part, and preserve every other character.

The new text is parsed to verify the edit. If a value outside of the edit has changed, the edit is refused.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from simscen.editor.text_editing.insertions import insert_entry, insert_item, remove_part
from simscen.editor.text_editing.splices import EditRefused, Splice, apply_splices, path_text
from simscen.editor.text_editing.value_text import flow_text, is_same_value, replacement_text
from simscen.loading.yaml.parser import parse_yaml
from simscen.loading.yaml.source_nodes import SourceNode, parse_source, source_at
from simscen.loading.yaml.tree import Key


@dataclass(frozen=True)
class SetValue:
    """Edit that sets the value at `keys`, and creates the missing mappings that contain it.

    `order` lists the top-level keys of the file in their usual order. A new key is inserted according to this order,
    also in nested mappings with the same keys, such as `robots.a`.
    """

    keys: tuple[Key, ...]
    value: Any
    order: tuple[str, ...] = ()


@dataclass(frozen=True)
class AddItem:
    """Edit that inserts an item into the list at `keys` before the item `index`, or at the end for None.

    A missing list is created. `order` is as in SetValue.
    """

    keys: tuple[Key, ...]
    value: Any
    index: int | None = None
    order: tuple[str, ...] = ()


@dataclass(frozen=True)
class RemovePart:
    """Edit that removes the entry or the item at `keys`."""

    keys: tuple[Key, ...]


Edit = SetValue | AddItem | RemovePart


def apply_edits(text: str, edits: Sequence[Edit]) -> str:
    """Apply edits one after the other, and return the new text. Raises EditRefused if an edit is impossible."""
    remaining = list(edits)
    while remaining:
        source = parse_source(text)
        if source is None:
            raise EditRefused("the text is not valid YAML; correct it first")
        splices = _independent_splices(text, source, remaining) or [_splice(text, source, remaining[0])]
        new = apply_splices(text, splices)
        _require_only_edits(text, new, remaining[: len(splices)])
        text, remaining = new, remaining[len(splices) :]
    return text


def _independent_splices(text: str, source: SourceNode, edits: Sequence[Edit]) -> list[Splice]:
    """Return the splices of the first edits, as long as each edit replaces a scalar that no edit before replaced.

    These splices can be applied together, because they do not change the structure of the syntax tree `source`.
    """
    splices: list[Splice] = []
    for edit in edits:
        if not isinstance(edit, SetValue) or isinstance(edit.value, dict | list):
            break
        node = source_at(source, edit.keys)
        if node is None or node.kind != "scalar":
            break
        splice = _replacement(text, node, edit.value)
        if any(other.start < splice.end and splice.start < other.end for other in splices):
            break
        splices.append(splice)
    return splices


def _splice(text: str, source: SourceNode, edit: Edit) -> Splice:
    """Return the splice that makes an edit. Raises EditRefused if the edit is impossible."""
    match edit:
        case SetValue(keys, value, order):
            return _set_value(text, source, keys, value, order)
        case AddItem(keys, value, index, order):
            node = source_at(source, keys)
            if node is not None and node.kind == "sequence":
                return insert_item(text, node, value, index)
            if node is not None and text[node.start : node.end] not in ("", "~", "null"):
                raise EditRefused(f"{path_text(keys)} is not written out as a list here; edit the text")
            return _set_value(text, source, keys, [value], order)
        case RemovePart(keys):
            return remove_part(text, source, keys)


def _set_value(text: str, source: SourceNode, keys: tuple[Key, ...], value: Any, order: tuple[str, ...]) -> Splice:
    """Return the splice that replaces a value, or inserts a new value into the innermost existing mapping."""
    if (node := source_at(source, keys)) is not None:
        return _replacement(text, node, value)
    for depth in range(len(keys) - 1, -1, -1):
        parent = source_at(source, keys[:depth])
        if parent is None:
            continue
        missing = keys[depth:]
        if not all(isinstance(key, str) for key in missing):
            break
        for key in reversed(missing[1:]):
            value = {key: value}
        if parent.kind == "mapping":
            return insert_entry(text, parent, str(missing[0]), value, order)
        if parent.kind == "scalar" and text[parent.start : parent.end] in ("", "~", "null"):
            return _replacement(text, parent, {missing[0]: value})
        break
    raise EditRefused(f"{path_text(keys)} is not written out in this file; edit the text, or the file that has it")


def _replacement(text: str, node: SourceNode, value: Any) -> Splice:
    """Return the splice that replaces the text of a node by a value."""
    old = text[node.start : node.end]
    if isinstance(value, dict | list):
        new = flow_text(value)
    elif node.kind == "scalar":
        new = replacement_text(value, old, node.style)
    else:
        new = replacement_text(value, "", "")
    if node.start == node.end and text[node.start - 1 : node.start] in (":", "-"):
        new = f" {new}"
    return Splice(node.start, node.end, new)


def _require_only_edits(old: str, new: str, edits: Sequence[Edit]) -> None:
    """Raise EditRefused if the content of the new text is not the content of the old text after the edits."""
    before, after = parse_yaml(old, "")[0], parse_yaml(new, "")[0]
    if before is None or after is None:
        raise EditRefused("this cannot be changed on the map; edit the text")
    expected = before.plain
    for edit in edits:
        expected = _edited_data(expected, edit)
    if not is_same_value(after.plain, expected):
        raise EditRefused("this cannot be changed on the map without changing other values; edit the text")


def _edited_data(plain: Any, edit: Edit) -> Any:
    """Return the parsed content after an edit. `plain` is changed in place, unless the edit replaces all of it."""
    holder = {"": plain}
    node: Any = holder
    path: list[Key] = ["", *edit.keys]
    for key in path[:-1]:
        if isinstance(node, dict) and node.get(str(key)) is None:
            node[str(key)] = {}
        node = node[key if isinstance(node, list) else str(key)]
    last = path[-1] if isinstance(node, list) else str(path[-1])
    match edit:
        case SetValue(value=value):
            node[last] = value
        case AddItem(value=value, index=index):
            if isinstance(node, dict) and node.get(last) is None:
                node[last] = []
            node[last].insert(len(node[last]) if index is None else index, value)
        case RemovePart():
            del node[last]
    return holder[""]
