"""Slips of the pen that many make: what was meant instead."""

from collections.abc import Iterable, Sequence

from pydantic import BaseModel

from simscen.loading.grammar import keys_of, models_at, needs_nothing
from simscen.loading.messages import suggestion
from simscen.loading.tree import Fields, Items, Key, Leaf, Node, dotted
from simscen.spec.choice import Choice
from simscen.spec.places import PoseSpec

DEEPEST = 3
"""How many levels below a mapping a key is looked for that stands too high."""


def of_wrong_type(kind: str, model: type[BaseModel], loc: Sequence[Key], node: Node) -> str:
    """How to write what was meant where a mapping or a list is expected at `loc` below `model`."""
    models = models_at(model, loc)
    in_list = isinstance(next((part for part in reversed(loc) if not _is_tag(part)), ""), int)
    if kind == "list_type":
        return _as_list(node, in_list)
    if isinstance(node, Items):
        return _as_mapping(models, node)
    if isinstance(node, Leaf) and isinstance(node.value, str):
        return _as_word(models, node.value, in_list)
    return ""


def of_place(model: type[BaseModel], loc: Sequence[Key], key: str) -> str:
    """Where a key belongs that stands a level too deep or too high; "" where it is unknown on every level."""
    for length in range(len(loc) - 1, -1, -1):
        if key in keys_of(models_at(model, loc[:length])):
            above = dotted([part for part in loc[:length] if not _is_tag(part)])
            return f"it belongs into `{above}`, a level up" if above else "it belongs to the top level of the file"
    for start, models in ((loc, models_at(model, loc)), ((), [model])):
        if (below := _deeper(models, key)) is not None:
            return f"it belongs into `{dotted([*start, *below])}`"
    return ""


def _as_list(node: Node, in_list: bool) -> str:
    if in_list and isinstance(node, Leaf) and isinstance(node.value, int | float):
        return "each point is a list of its own: `[[1, 2], [3, 4]]`"
    if isinstance(node, Fields):
        return "begin each entry of the list with `- `"
    return f"write `[{node.value}]`" if isinstance(node, Leaf) and isinstance(node.value, str) else ""


def _as_mapping(models: Iterable[type[BaseModel]], node: Items) -> str:
    if all(isinstance(item, Fields) for item in node.items):
        return "remove the `-`: it is no list"
    values = [str(item.value) for item in node.items if isinstance(item, Leaf)]
    if len(values) != len(node.items) or len(values) not in (2, 3):
        return ""
    pose = f"{{{', '.join(f'{key}: {value}' for key, value in zip(('x', 'y', 'yaw'), values, strict=False))}}}"
    for model in models:
        if issubclass(model, PoseSpec):
            return f"write `{pose}`"
        if "pose" in model.model_fields:
            return f"write `{{pose: {pose}}}`"
    return ""


def _as_word(models: Iterable[type[BaseModel]], word: str, in_list: bool) -> str:
    """A word of a choice without its colon."""
    for choice in (model for model in models if issubclass(model, Choice)):
        keys = [*choice.choices()]
        if word not in keys:
            near = suggestion(word, keys)
            return near.replace("`?", ": …`?") if near.startswith("did") else ""
        told = models_at(choice, [word])
        body = "{}" if told and all(needs_nothing(model) for model in told) else "…"
        written = f"`{word}: {body}`" if in_list else f"`{{{word}: {body}}}`"
        return f"write {written}" + ("" if body == "{}" else f"; `simscen explain {word}` tells what it takes")
    return ""


def _deeper(models: Iterable[type[BaseModel]], key: str, depth: int = 1) -> list[Key] | None:
    """The keys of mappings that lead to the nearest one that knows `key`."""
    holders = [(name, models_at(model, [name])) for model in models if not issubclass(model, Choice)
               for name in keys_of([model])]  # fmt: skip
    for name, below in holders:
        if any(not issubclass(model, Choice) and key in keys_of([model]) for model in below):
            return [name]
    if depth < DEEPEST:
        for name, below in holders:
            if (found := _deeper(below, key, depth + 1)) is not None:
                return [name, *found]
    return None


def _is_tag(part: Key) -> bool:
    return isinstance(part, str) and " " in part
