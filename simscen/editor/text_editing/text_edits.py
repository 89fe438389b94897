"""Change single values of a YAML text and leave every other character of it as it is.

An edit replaces the text of a node, inserts a key or an item, or removes one. Each new text is parsed again: if it does
not mean exactly the old content with the edit, the edit is refused, and the text stays as it was.
"""

import copy
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

from simscen.editor.text_editing.insertions import added_item, inserted_entry, removed_part
from simscen.editor.text_editing.splices import EditRefused, Splice, path_text, spliced
from simscen.editor.text_editing.value_text import flow_text, replacing_text, same_value
from simscen.loading.yaml.parser import parse_yaml
from simscen.loading.yaml.source_nodes import SourceNode, parse_source, source_at
from simscen.loading.yaml.tree import Key


@dataclass(frozen=True)
class SetValue:
    """Set the value at `keys`; mappings on the way that are missing are created.

    `order` lists keys in the order of the language, for a key that does not exist yet.
    """

    keys: tuple[Key, ...]
    value: Any
    order: tuple[str, ...] = ()


@dataclass(frozen=True)
class AddItem:
    """Insert an item into the list at `keys`, before the item `index`; None: at the end."""

    keys: tuple[Key, ...]
    value: Any
    index: int | None = None
    order: tuple[str, ...] = ()


@dataclass(frozen=True)
class RemovePart:
    """Remove a key or an item."""

    keys: tuple[Key, ...]


Edit = SetValue | AddItem | RemovePart


class EditedText(NamedTuple):
    """A text after some edits, and what was replaced, in the order in which it happened."""

    text: str
    splices: tuple[Splice, ...]


def apply_edits(text: str, edits: Sequence[Edit]) -> EditedText:
    """Return the text after the edits, one after the other. Raises EditRefused if one of them is impossible."""
    done: list[Splice] = []
    remaining = list(edits)
    while remaining:
        source = _source(text)
        splices = _independent_splices(text, source, remaining)
        taken = len(splices)
        if not splices:
            splices, taken = [_splice(text, source, remaining[0])], 1
        splices = [splice for splice in splices if text[splice.start : splice.end] != splice.text]
        new = spliced(text, splices)
        _require_meaning(text, new, remaining[:taken])
        done += splices
        text, remaining = new, remaining[taken:]
    return EditedText(text, tuple(done))


def _source(text: str) -> SourceNode:
    source = parse_source(text)
    if source is None:
        raise EditRefused("the text is not valid YAML; correct it first")
    return source


def _independent_splices(text: str, source: SourceNode, edits: Sequence[Edit]) -> list[Splice]:
    """Return the splices of the first edits as far as each replaces a scalar of its own: they cannot disturb others."""
    found: list[Splice] = []
    for edit in edits:
        node = source_at(source, edit.keys) if isinstance(edit, SetValue) else None
        if (
            node is None
            or node.kind != "scalar"
            or not isinstance(edit, SetValue)
            or isinstance(edit.value, dict | list)
        ):
            break
        splice = _replacement(text, node, edit.value)
        if any(other.start < splice.end and splice.start < other.end for other in found):
            break
        found.append(splice)
    return found


def _splice(text: str, source: SourceNode, edit: Edit) -> Splice:
    match edit:
        case SetValue(keys, value, order):
            return _set(text, source, keys, value, order)
        case AddItem(keys, value, index, order):
            node = source_at(source, keys)
            if node is not None and node.kind == "sequence":
                return added_item(text, node, value, index)
            if node is not None and text[node.start : node.end] not in ("", "~", "null"):
                raise EditRefused(f"{path_text(keys)} is not written out as a list here; edit the text")
            return _set(text, source, keys, [value], order)
        case RemovePart(keys):
            return removed_part(text, source, keys)


def _set(text: str, source: SourceNode, keys: tuple[Key, ...], value: Any, order: tuple[str, ...]) -> Splice:
    """Return the splice that sets a value, in the deepest node on the way that exists."""
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
            return inserted_entry(
                text, parent, str(missing[0]), value, order if len(missing) == 1 or depth == 0 else ()
            )
        if parent.kind == "scalar" and text[parent.start : parent.end] in ("", "~", "null"):
            return _replacement(text, parent, {missing[0]: value})
        break
    raise EditRefused(f"{path_text(keys)} is not written out in this file; edit the text, or the file that has it")


def _replacement(text: str, node: SourceNode, value: Any) -> Splice:
    """Return the splice that replaces the text of a node."""
    old = text[node.start : node.end]
    if isinstance(value, dict | list):
        new = flow_text(value)
    elif node.kind == "scalar":
        new = replacing_text(value, old, node.style)
    else:
        new = replacing_text(value, "", "")
    if node.start == node.end and text[node.start - 1 : node.start] in (":", "-"):
        new = f" {new}"
    return Splice(node.start, node.end, new)


def _require_meaning(old: str, new: str, edits: Sequence[Edit]) -> None:
    """Raise EditRefused unless the new text means the old content with the edits."""
    before, after = parse_yaml(old, "")[0], parse_yaml(new, "")
    if before is None or after[0] is None:
        raise EditRefused("this cannot be changed on the map without changing other text; edit the text")
    wanted = before.plain
    for edit in edits:
        wanted = _changed(wanted, edit)
    if not same_value(after[0].plain, wanted):
        raise EditRefused("this cannot be changed on the map without changing other values; edit the text")


def _changed(plain: Any, edit: Edit) -> Any:
    """Return plain data with an edit."""
    plain = copy.deepcopy(plain)
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
