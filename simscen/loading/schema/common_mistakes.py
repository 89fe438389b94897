"""Hints for common mistakes in YAML files: wrong types, misplaced keys, and reserved keys.

A Choice is a mapping with one key that selects its kind, such as the criterion `collisions: {max: 0}`. A `loc` is the
location of a validation error in pydantic: keys and list indices, with tags of union members between them.
"""

import math
from collections.abc import Iterable, Sequence
from functools import lru_cache

from pydantic import BaseModel, ValidationError

from simscen.loading.schema.lookup import has_no_required_keys, keys_of, models_at
from simscen.loading.schema.messages import did_you_mean
from simscen.loading.spec_walk import fields_with_angles
from simscen.loading.yaml.tree import Key, Keys, MappingNode, Node, ScalarNode, SequenceNode, dotted_path, existing_keys
from simscen.spec.choice import Choice
from simscen.spec.places import PoseSpec
from simscen.spec.quantities import MAX_TEXT_CHARS

HINTS_FOR_BOUNDS: dict[Keys, str] = {
    ("physics", "truth_rate"): "criteria are judged at these samples; lower rates miss short violations"
}
"""Hints for values outside their bounds, by the keys of the value."""
FILE_KEYS = ("file", "path", "yaml", "urdf", "xacro")
"""Keys that authors write to name a file, but that neither `world` nor `robot` has."""
MAX_SEARCH_DEPTH = 3
"""Number of levels below a mapping that are searched for the right place of a misplaced key."""

MappingKeys = tuple[tuple[str, ...], frozenset[str]]
"""The keys that lead to a mapping, and its valid keys."""


def hint_for_wrong_type(error_type: str, model: type[BaseModel], loc: Sequence[Key], node: Node) -> str:
    """Return a hint on how to write `node`, the value at `loc`, as the expected mapping or list; "" if unknown.

    `model` is the model of the whole file. `error_type` is pydantic's type of the error, such as "list_type".
    """
    models = models_at(model, loc)
    keys = [part for part in loc if isinstance(part, int) or " " not in part]  # tags of unions contain a space
    is_in_list = bool(keys) and isinstance(keys[-1], int)
    if error_type == "list_type":
        return _list_hint(node, is_in_list)
    if isinstance(node, SequenceNode):
        return _sequence_for_mapping_hint(models, node)
    if isinstance(node, ScalarNode):
        colon_hint = _missing_colon_hint(models, node.value, is_in_list) if isinstance(node.value, str) else ""
        if hint := colon_hint or _scalar_for_mapping_hint(models, node):
            return hint
        parents = models_at(model, loc[:-1]) if loc else ()
        if any(issubclass(parent, Choice) and loc[-1] in parent.choices() for parent in parents):
            return f"`simscen explain {loc[-1]}` shows its keys"
    return ""


def hint_for_bounds(model: type[BaseModel], loc: Sequence[Key], node: Node) -> str:
    """Return the reason for the bounds of `node`, or a hint that an angle could be in degrees; "" if unknown."""
    value = node.value if isinstance(node, ScalarNode) else None
    parents = models_at(model, loc[:-1])
    is_angle = any(keys == (loc[-1],) for parent in parents for _, keys, _ in fields_with_angles(parent))
    if is_angle and isinstance(value, int | float) and abs(value) > 2 * math.pi:
        return f"angles without a unit are in radians; did you mean `{value:g} deg`?"
    return HINTS_FOR_BOUNDS.get(tuple(loc), "")


def hint_for_misplaced_key(model: type[BaseModel], tree: Node, loc: Sequence[Key], key: str) -> str:
    """Return a hint on where to move an unknown key of the mapping at `loc`; "" if unknown.

    Inside an item of a list, the hint leads to a place in the same item.
    """
    item = next((index + 1 for index, part in enumerate(loc) if isinstance(part, int)), 0)
    for length in range(len(loc) - 1, item - 1, -1):
        if key in keys_of(models_at(model, loc[:length])):
            parent = dotted_path(existing_keys(tree, loc[:length]))
            return f"move it to `{parent}`" if parent else "move it to the top level of the file"
    starts = ((loc, models_at(model, loc)), ((), [model]))
    for start, models in starts[:1] if item else starts:
        for below, valid_keys in _mappings_below(tuple(models)):
            if key in valid_keys:
                return f"move it to `{dotted_path([*existing_keys(tree, start), *below])}`"
    return ""


def hint_for_known_mistake(loc: Sequence[Key], key: str) -> str:
    """Return a hint for keys that name a file, and for reserved keys; "" for other keys.

    Reserved are `robot` in faults and criteria, and `then` in a step of a sequence.
    """
    keys = [part for part in loc if isinstance(part, int) or " " not in part]  # tags of unions contain a space
    if key in FILE_KEYS and keys == ["world"]:
        return "write the path as the value: `world: FILE`"
    if key in FILE_KEYS and keys == ["robot"]:
        return "write `model: FILE`"
    if key == "robot" and loc and loc[0] in ("faults", "pass", "robots"):
        return "write it under the name of the robot: `robots: {NAME: {faults: …, pass: …}}`"
    if key == "then" and "then" in loc:
        return "a step has no steps of its own; add them to the same list, after this step"
    return ""


def _list_hint(node: Node, is_in_list: bool) -> str:
    """Return a hint on how to write `node` as a list; "" if unknown. `is_in_list`: `node` is an item of a list."""
    if is_in_list and isinstance(node, ScalarNode) and isinstance(node.value, int | float):
        return "write each point as a list: `[[1, 2], [3, 4]]`"
    if isinstance(node, MappingNode):
        point = [entry.value.value for entry in node.entries.values() if isinstance(entry.value, ScalarNode)]
        if list(node.entries) == ["x", "y"] and len(point) == 2:
            return f"write the point as a list: `[{point[0]}, {point[1]}]`"
        return "start each item of the list with `- `"
    word = node.value if isinstance(node, ScalarNode) and isinstance(node.value, str) else ""
    return f"write `[{word}]`" if 0 < len(word) <= MAX_TEXT_CHARS else ""


def _sequence_for_mapping_hint(models: Iterable[type[BaseModel]], node: SequenceNode) -> str:
    """Return a hint on how to write a list as a mapping: without `-`, or as a pose; "" if unknown."""
    if node.items and all(isinstance(item, MappingNode) for item in node.items):
        return "remove the `-`: a mapping is expected, not a list"
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


def _scalar_for_mapping_hint(models: Iterable[type[BaseModel]], node: ScalarNode) -> str:
    """Return a hint on how to write a value as `{key: value}`, or `true` as `{}`; "" if unknown."""
    plain_models = [model for model in models if not issubclass(model, Choice)]
    matching = {key for model in plain_models for key in keys_of([model]) if _is_valid(model, {key: node.value})}
    if len(matching) == 1 and not isinstance(node.value, bool):
        return f"write `{{{matching.pop()}: {node.value}}}`"
    return "write `{}`" if node.value is True and plain_models and all(map(has_no_required_keys, plain_models)) else ""


def _is_valid(model: type[BaseModel], value: dict[str, object]) -> bool:
    try:
        model.model_validate(value, by_alias=True, by_name=False)
    except ValidationError:
        return False
    return True


def _missing_colon_hint(models: Iterable[type[BaseModel]], word: str, is_in_list: bool) -> str:
    """Return a hint on how to write the text `word` as a key of a Choice, with a colon and a value; "" if unknown."""
    for choice in (model for model in models if issubclass(model, Choice)):
        keys = [*choice.choices()]
        if word not in keys:
            return did_you_mean(word, keys).replace("`?", ": …`?")
        chosen = models_at(choice, [word])
        body = "{}" if chosen and all(has_no_required_keys(model) for model in chosen) else "…"
        written = f"`{word}: {body}`" if is_in_list else f"`{{{word}: {body}}}`"
        return f"write {written}" + ("" if body == "{}" else f"; `simscen explain {word}` shows its keys")
    return ""


@lru_cache(maxsize=64)  # a file of another kind has many unknown keys
def _mappings_below(models: tuple[type[BaseModel], ...], depth: int = 1) -> tuple[MappingKeys, ...]:
    """Return the mappings from `depth` to MAX_SEARCH_DEPTH levels below `models`, the nearest first in each branch."""
    holders = [(name, tuple(models_at(model, [name]))) for model in models if not issubclass(model, Choice)
               for name in keys_of([model])]  # fmt: skip
    found: list[MappingKeys] = [
        ((name,), frozenset(keys_of(model for model in below if not issubclass(model, Choice))))
        for name, below in holders
    ]
    if depth < MAX_SEARCH_DEPTH:
        for name, below in holders:
            found += [((name, *keys), valid_keys) for keys, valid_keys in _mappings_below(below, depth + 1)]
    return tuple(found)
