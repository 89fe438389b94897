"""Conversion of the user's changes on the map or in a form to edits of the text."""

import math
from collections.abc import Iterator
from typing import Any

from simscen.editor.map_view.map_objects import Keys
from simscen.editor.text_editing.splices import EditRefused
from simscen.editor.text_editing.text_edits import AddItem, Edit, RemovePart, SetValue
from simscen.editor.value_schemas import schema_of_kind
from simscen.loading.yaml.source_nodes import SourceNode, parse_source, source_at


def read_edits(request: Any, text: str, kind: str) -> list[Edit]:
    """Convert `request`, a list of changes, to edits of `text`. `kind` is "scenario" or "world".

    A change is a mapping with the operation `op`, the path `keys`, and further arguments. The operations `set`, `add`,
    and `remove` change any value. `pose` and `keyframe` set a position in m and, if given, a heading in rad; `point`
    sets a position. Raises EditRefused for a malformed request.
    """
    if not isinstance(request, list):
        raise EditRefused("the request has no list of changes")
    order = tuple(schema_of_kind(kind)["properties"])
    source = parse_source(text)
    return [edit for change in request for edit in _read_change(change, source, order)]


def _read_change(change: Any, source: SourceNode | None, order: tuple[str, ...]) -> Iterator[Edit]:
    """Yield the edits for one change. `source` is the syntax tree of the text; `order` is the order of new keys."""
    if not isinstance(change, dict):
        raise EditRefused("a change must be a mapping")
    keys = read_keys(change.get("keys"))
    match change.get("op"):
        case "set":
            yield SetValue(keys, change.get("value"), order)
        case "add":
            index = change.get("index")
            yield AddItem(keys, change.get("value"), index if isinstance(index, int) else None, order)
        case "remove":
            yield RemovePart(keys)
        case "pose":
            yield from _pose_edits(keys, _number(change, "x"), _number(change, "y"), _yaw(change), source, order)
        case "point":
            yield from _list_edits(keys, {0: _number(change, "x"), 1: _number(change, "y")}, source)
        case "keyframe":
            yaw = _yaw(change)
            position = {1: _number(change, "x"), 2: _number(change, "y")}
            yield from _list_edits(keys, position if yaw is None else {**position, 3: yaw}, source)
        case _:
            raise EditRefused("unknown kind of change")


def _pose_edits(
    keys: Keys, x: float, y: float, yaw: float | None, source: SourceNode | None, order: tuple[str, ...]
) -> Iterator[Edit]:
    """Yield edits that set x, y, and yaw of the mapping at `keys`, or that replace another value by such a mapping.

    `yaw` is None to keep the heading.
    """
    node = None if source is None else source_at(source, keys)
    if node is not None and node.kind == "mapping":
        yield SetValue((*keys, "x"), x)
        yield SetValue((*keys, "y"), y)
        if yaw is not None:
            # SetValue keeps the unit of an existing number.
            yield SetValue((*keys, "yaw"), yaw if "yaw" in node.entries else degrees_text(yaw))
        return
    pose: dict[str, Any] = {"x": x, "y": y} if not yaw else {"x": x, "y": y, "yaw": degrees_text(yaw)}
    parent = None if source is None or node is not None else source_at(source, keys[:-1])
    if parent is not None and parent.kind == "scalar" and keys[-1] == "pose":
        yield SetValue(keys[:-1], {"pose": pose})  # the name of a place instead of a goal
    else:
        yield SetValue(keys, pose, order)


def _list_edits(keys: Keys, numbers: dict[int, float], source: SourceNode | None) -> Iterator[Edit]:
    """Yield edits that set numbers of a list such as [x, y] or [t, x, y, yaw]. `numbers` are the new numbers by index.

    If the text has no list at `keys`, `numbers` become a new list. Raises EditRefused if the new list would lack index
    0. This is the case for a keyframe, because a change of a keyframe does not contain the time t.
    """
    node = None if source is None else source_at(source, keys)
    if node is not None and node.kind == "sequence":
        for index, value in numbers.items():
            yield SetValue((*keys, index), value)
    elif 0 in numbers:
        yield SetValue(keys, list(numbers.values()))
    else:
        raise EditRefused("the keyframe is not a list in this file; change it where it is written")


def degrees_text(yaw: float) -> str:
    """Return an angle in rad as text in degrees, for example "90 deg"."""
    return f"{round(math.degrees(yaw), 3):g} deg"


def read_keys(value: Any) -> Keys:
    """Return the keys in a request. Raises EditRefused if `value` is not a list of strings and indices."""
    if not isinstance(value, list) or not all(
        isinstance(key, str) or (isinstance(key, int) and not isinstance(key, bool) and key >= 0) for key in value
    ):
        raise EditRefused("the request has no list of keys")
    return tuple(value)


def _number(change: dict[str, Any], key: str) -> float:
    """Return the number at a key of a change. Raises EditRefused if the value is not a finite number."""
    value = change.get(key)
    if not isinstance(value, int | float) or isinstance(value, bool) or not math.isfinite(value):
        raise EditRefused(f"a change needs a number `{key}`")
    return value


def _yaw(change: dict[str, Any]) -> float | None:
    """Return the heading of a change in rad; None if the change has no heading."""
    return None if change.get("yaw") is None else _number(change, "yaw")
