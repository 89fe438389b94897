"""Slips of the pen that many make: what was meant instead."""

from collections.abc import Iterable, Sequence

from pydantic import BaseModel, ValidationError

from simscen.loading.schema.lookup import keys_of, models_at, needs_nothing
from simscen.loading.schema.messages import suggestion
from simscen.loading.yaml.tree import Key, MappingNode, Node, ScalarNode, SequenceNode, dotted_path, existing_keys
from simscen.spec.choice import Choice
from simscen.spec.places import PoseSpec

DEEPEST = 3
"""How many levels below a mapping a key is looked for that stands too high."""


def hint_for_wrong_type(kind: str, model: type[BaseModel], loc: Sequence[Key], node: Node) -> str:
    """How to write what was meant where a mapping or a list is expected at `loc` below `model`."""
    models = models_at(model, loc)
    in_list = isinstance(next((part for part in reversed(loc) if not _is_tag(part)), ""), int)
    if kind == "list_type":
        return _as_list(node, in_list)
    if isinstance(node, SequenceNode):
        return _as_mapping(models, node)
    if isinstance(node, ScalarNode):
        word = _as_word(models, node.value, in_list) if isinstance(node.value, str) else ""
        return word or _as_value(models, node) or _as_told(model, loc)
    return ""


def hint_for_misplaced_key(model: type[BaseModel], tree: Node, loc: Sequence[Key], key: str) -> str:
    """Where a key belongs that stands a level too deep or too high; "" where it is unknown on every level.

    What an item of a list says is said of that item: it is looked for no higher.
    """
    item = next((index + 1 for index, part in enumerate(loc) if isinstance(part, int)), 0)
    for length in range(len(loc) - 1, item - 1, -1):
        if key in keys_of(models_at(model, loc[:length])):
            above = dotted_path(existing_keys(tree, loc[:length]))
            return f"it belongs into `{above}`, a level up" if above else "it belongs to the top level of the file"
    starts = ((loc, models_at(model, loc)), ((), [model]))
    for start, models in starts[:1] if item else starts:
        if (below := _deeper(models, key)) is not None:
            return f"it belongs into `{dotted_path([*existing_keys(tree, start), *below])}`"
    return ""


def hint_for_reserved_key(loc: Sequence[Key], key: str) -> str:
    """What a key means that stands where only others may: whose a fault or criterion is, and steps of steps."""
    if key == "robot" and loc and loc[0] in ("faults", "pass", "robots"):
        return "what is of one of several robots stands under its name: `robots: {NAME: {faults: …, pass: …}}`"
    if key == "then" and "then" in loc:
        return "a step has no steps of its own: write them behind it, in the same list"
    return ""


def _as_list(node: Node, in_list: bool) -> str:
    if in_list and isinstance(node, ScalarNode) and isinstance(node.value, int | float):
        return "each point is a list of its own: `[[1, 2], [3, 4]]`"
    if isinstance(node, MappingNode):
        return "begin each entry of the list with `- `"
    return f"write `[{node.value}]`" if isinstance(node, ScalarNode) and isinstance(node.value, str) else ""


def _as_mapping(models: Iterable[type[BaseModel]], node: SequenceNode) -> str:
    if all(isinstance(item, MappingNode) for item in node.items):
        return "remove the `-`: it is no list"
    values = [str(item.value) for item in node.items if isinstance(item, ScalarNode)]
    if len(values) != len(node.items) or len(values) not in (2, 3):
        return ""
    pose = f"{{{', '.join(f'{key}: {value}' for key, value in zip(('x', 'y', 'yaw'), values, strict=False))}}}"
    for model in models:
        if issubclass(model, PoseSpec):
            return f"write `{pose}`"
        if "pose" in model.model_fields:
            return f"write `{{pose: {pose}}}`"
    return ""


def _as_value(models: Iterable[type[BaseModel]], node: ScalarNode) -> str:
    """A mapping that needs one key, or none, of which only the value is written."""
    plain = [model for model in models if not issubclass(model, Choice)]
    fitting = {key for model in plain for key in keys_of([model]) if _holds(model, {key: node.value})}
    if len(fitting) == 1 and not isinstance(node.value, bool):
        return f"write `{{{fitting.pop()}: {node.value}}}`"
    return "write `{}`" if node.value is True and plain and all(map(needs_nothing, plain)) else ""


def _holds(model: type[BaseModel], value: dict[str, object]) -> bool:
    try:
        model.model_validate(value, by_alias=True, by_name=False)
    except ValidationError:
        return False
    return True


def _as_told(model: type[BaseModel], loc: Sequence[Key]) -> str:
    """Where to read what a word takes."""
    chosen = any(issubclass(one, Choice) and loc[-1] in one.choices() for one in models_at(model, loc[:-1]) if loc)
    return f"`simscen explain {loc[-1]}` tells what it takes" if chosen else ""


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
