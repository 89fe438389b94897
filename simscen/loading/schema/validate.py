"""Validate a tree against a pydantic model."""

import re
from collections.abc import Callable, Iterator
from itertools import islice
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from simscen.core.errors import Problem
from simscen.loading.schema import common_mistakes, messages
from simscen.loading.schema.lookup import has_no_required_keys, keys_of, models_at, type_values_at, type_values_with_key
from simscen.loading.yaml import textfile
from simscen.loading.yaml.tree import (
    Keys,
    MappingNode,
    Node,
    Position,
    ScalarNode,
    child,
    dotted_path,
    existing_keys,
    key_position,
    node_at,
    nodes_with_keys,
    value_position,
)
from simscen.spec.choice import Choice
from simscen.triggers.base import AnyCondition, Trigger

Model = TypeVar("Model", bound=BaseModel)
LANGUAGE_VERSION = 1


MissingKeys = Callable[[MappingNode], list[Problem]]
"""Finds problems that depend on several keys, which a model cannot express."""


def check(model: type[Model], tree: Node, find_missing_keys: MissingKeys | None = None) -> Model | list[Problem]:
    """Return the specification in `tree`, or all its problems, including those that `find_missing_keys` finds."""
    if not isinstance(tree, MappingNode):
        return [
            _problem(tree.position, "SC004", f"expected a mapping at top level, got {messages.describe_node(tree)}")
        ]
    if problem := _wrong_version(tree):
        return [problem]
    empty = [_empty_value_problem(model, tree, loc) for loc in _empty_values(tree)]
    missing = find_missing_keys(tree) if find_missing_keys is not None else []
    try:
        spec = model.model_validate(tree.plain, by_alias=True, by_name=False)
    except ValidationError as error:
        errors = error.errors(include_input=False, include_url=False)
        found = [_translate(model, tree, dict(e)) for e in errors if not _is_caused_by_empty_value(tree, dict(e))]
        return _without_duplicates([*empty, *missing, *found])
    return [*empty, *missing] or spec


def check_partial(model: type[BaseModel], tree: Node) -> list[Problem]:
    """Return the problems of a file that other files extend; missing keys are allowed, except inside of lists."""
    if not isinstance(tree, MappingNode):
        return [
            _problem(tree.position, "SC004", f"expected a mapping at top level, got {messages.describe_node(tree)}")
        ]
    if problem := _wrong_version(tree):
        return [problem]
    empty = [_empty_value_problem(model, tree, loc) for loc in _empty_values(tree)]
    try:
        model.model_validate(tree.plain, by_alias=True, by_name=False)
    except ValidationError as error:
        errors = [dict(found) for found in error.errors(include_input=False, include_url=False)]
        relevant = [
            found for found in errors if not _is_missing_key(found) and not _is_caused_by_empty_value(tree, found)
        ]
        return _without_duplicates([*empty, *(_translate(model, tree, found) for found in relevant)])
    return empty


def _is_missing_key(error: dict[str, Any]) -> bool:
    """Return whether an error is a missing key outside of lists."""
    in_a_list = any(isinstance(part, int) for part in error["loc"])
    return error["type"] in ("missing", "union_tag_not_found") and not in_a_list


def _wrong_version(tree: MappingNode) -> Problem | None:
    version = child(tree, "simscen")
    if not isinstance(version, ScalarNode) or version.value == LANGUAGE_VERSION or isinstance(version.value, bool):
        return None
    if not isinstance(version.value, int):
        return None
    message = f"needs schema {version.value}; this version of simscen supports {LANGUAGE_VERSION}"
    return _problem(version.position, "SC009", message)


def _translate(model: type[BaseModel], tree: Node, error: dict[str, Any]) -> Problem:
    loc: Keys = error["loc"]
    kind: str = error["type"]
    if kind == "extra_forbidden":
        return _unknown_key(model, tree, loc)
    if kind == "missing":
        return _missing_key(tree, loc)
    if kind.startswith("union_tag"):
        return _wrong_type(model, tree, loc, error)
    if loc and loc[-1] == "[key]":
        name = ScalarNode(tree.position, str(loc[-2]))
        return _problem(
            key_position(tree, loc), *messages.translate_error(kind, error.get("ctx", {}), name, error["msg"])
        )
    node = node_at(tree, loc)
    message = messages.translate_error(kind, error.get("ctx", {}), node, error["msg"])
    if not message.hint and kind in ("model_type", "model_attributes_type", "list_type"):
        message = message._replace(hint=common_mistakes.hint_for_wrong_type(kind, model, loc, node))
    elif not message.hint and message.code == "SC013":
        message = message._replace(hint=common_mistakes.HINTS_FOR_BOUNDS.get(loc, ""))
    if kind == "value_error" and isinstance(node, MappingNode):
        named = (name for name in re.findall(r"`(\w+)`", message.text) if name in node.entries)
        loc = (*loc, *islice(named, 1))  # the first key that the message names
    return _problem(value_position(tree, loc), *message)


def _unknown_key(model: type[BaseModel], tree: Node, loc: Keys) -> Problem:
    key = str(loc[-1])
    holder = dotted_path(existing_keys(tree, loc[:-1]))
    where = f" in `{holder}`" if holder else ""
    models = models_at(model, loc[:-1])
    hint = messages.suggestion(key, keys_of(models))
    if lookalike := textfile.lookalike_hint(key):
        hint = lookalike
    elif key in Trigger.modifiers and models == [AnyCondition]:
        hint = f"`{key}` applies to the whole trigger: write it next to `all`, `any` or `not` under `when`"
    elif others := type_values_with_key(model, loc[:-1], key):
        hint = f"`{key}` is a parameter of type {' and '.join(f'`{name}`' for name in others)}"
    elif reserved_key_hint := common_mistakes.hint_for_reserved_key(loc[:-1], key):
        hint = reserved_key_hint
    elif not hint.startswith("did") and (
        correct_place := common_mistakes.hint_for_misplaced_key(model, tree, loc[:-1], key)
    ):
        hint = correct_place
    elif not hint.startswith("did") and any(issubclass(one, Choice) and one.group for one in models):
        hint = "; ".join(filter(None, (hint, "`simscen plugins` lists what installed packages add")))
    return _problem(key_position(tree, loc), "SC012", f"unknown key {messages.quoted(key)}{where}", hint)


def _missing_key(tree: Node, loc: Keys) -> Problem:
    holder = dotted_path(existing_keys(tree, loc[:-1]))
    if isinstance(loc[-1], int):
        return _problem(key_position(tree, loc[:-1]), "SC017", f"`{holder}` has too few values: [{loc[-1]}] is missing")
    where = f" in `{holder}`" if holder else ""
    return _problem(key_position(tree, loc[:-1]), "SC010", f"missing key `{loc[-1]}`{where}")


def _wrong_type(model: type[BaseModel], tree: Node, loc: Keys, error: dict[str, Any]) -> Problem:
    """Return the problem of a mapping whose `type` is missing or unknown."""
    node, types = node_at(tree, loc), type_values_at(model, loc)
    if not isinstance(node, MappingNode):
        return _problem(value_position(tree, loc), "SC011", f"expected a mapping, got {messages.describe_node(node)}")
    if error["type"] == "union_tag_not_found":
        message = f"missing key `type` in `{dotted_path(existing_keys(tree, loc))}`"
        return _problem(key_position(tree, loc), "SC010", message, f"expected one of: {', '.join(types)}")
    written = str(error["ctx"]["tag"])
    message = f"{messages.quoted(written)} is not one of the choices"
    return _problem(value_position(tree, (*loc, "type")), "SC014", message, messages.suggestion(written, types))


def _empty_values(tree: Node) -> Iterator[Keys]:
    """Yield the keys of empty values: `off:` instead of `off: {}`, or a forgotten value."""
    return (keys for keys, node in nodes_with_keys(tree) if isinstance(node, ScalarNode) and node.value is None)


def _empty_value_problem(model: type[BaseModel], tree: Node, loc: Keys) -> Problem:
    *holder, key = loc
    if isinstance(key, int):
        return _problem(
            key_position(tree, loc), "SC018", f"item {key + 1} of `{dotted_path(holder)}` is empty", "remove it"
        )
    models = models_at(model, loc)
    complete = models and all(has_no_required_keys(option) for option in models)
    hint = f"write `{key}: {{}}`" if complete else "give it a value or remove the key"
    return _problem(key_position(tree, loc), "SC018", f"{messages.quoted(key)} has no value", hint)


def _is_caused_by_empty_value(tree: Node, error: dict[str, Any]) -> bool:
    """Return whether an error of pydantic is only a consequence of an empty value."""
    node = node_at(tree, error["loc"])
    if isinstance(node, ScalarNode):
        return node.value is None
    has_empty_value = isinstance(node, MappingNode) and any(e.value.plain is None for e in node.entries.values())
    return has_empty_value and error["type"] == "value_error"


def _without_duplicates(problems: list[Problem]) -> list[Problem]:
    """Return one problem per mistake: members of a union repeat problems, and a misspelled key is also missing."""
    places: dict[tuple[str, int, int, str], Problem] = {}
    for problem in problems:
        key = problem.code if problem.code == "SC010" else ""
        places.setdefault((problem.path, problem.line, problem.col, key and problem.message), problem)
    misspelled = {problem.hint for problem in problems if problem.code == "SC012"}
    return [p for p in places.values() if not (p.code == "SC010" and p.hint == "" and _spelling_hint(p) in misspelled)]


def _spelling_hint(missing: Problem) -> str:
    return f"did you mean {missing.message.split()[2]}?"


def _problem(position: Position, code: str, message: str, hint: str = "") -> Problem:
    return Problem(position.path, position.line, position.col, code, message, hint)
