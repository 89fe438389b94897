"""Validation of a YAML tree against a pydantic model. Errors become problems with positions and hints."""

import re
from collections.abc import Callable, Sequence
from itertools import islice
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from simscen.core.errors import Problem
from simscen.loading.schema import common_mistakes, messages
from simscen.loading.schema.lookup import has_no_required_keys, keys_of, models_at, type_values_at, type_values_with_key
from simscen.loading.yaml.syntax_problems import lookalike_hint
from simscen.loading.yaml.tree import (
    Keys,
    MappingNode,
    Node,
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

Model = TypeVar("Model", bound=BaseModel)
LANGUAGE_VERSION = 1
"""Version of the scenario language, which files state under the key `simscen`."""

FindMissingKeys = Callable[[MappingNode], list[Problem]]
"""Function that returns problems of keys that depend on other keys, such as a missing `robot` without `robots`."""


def check(model: type[Model], tree: Node, find_missing_keys: FindMissingKeys | None = None) -> Model | list[Problem]:
    """Return the specification of the class `model` in `tree`; or all problems, also from `find_missing_keys`."""
    mapping = _supported_mapping(tree)
    if isinstance(mapping, Problem):
        return [mapping]
    missing = find_missing_keys(mapping) if find_missing_keys is not None else []
    spec, errors = _validate(model, mapping)
    problems = _problems(model, mapping, errors, missing)
    return problems if problems or spec is None else spec


def check_partial(model: type[BaseModel], tree: Node) -> list[Problem]:
    """Return the problems of an incomplete file. Missing keys are problems only in items of lists."""
    mapping = _supported_mapping(tree)
    if isinstance(mapping, Problem):
        return [mapping]
    _, errors = _validate(model, mapping)
    return _problems(model, mapping, [error for error in errors if not _is_missing_key(error)])


def _supported_mapping(tree: Node) -> MappingNode | Problem:
    """Return the tree; or a problem if the tree is not a mapping, or has another version of the language."""
    return _version_problem(tree) or tree if isinstance(tree, MappingNode) else not_a_mapping_problem(tree)


def not_a_mapping_problem(tree: Node) -> Problem:
    """Return the problem that the tree of a file is not a mapping."""
    return Problem(*tree.position, "SC004", f"expected a mapping at top level, got {messages.describe_node(tree)}")


def _validate(model: type[Model], tree: MappingNode) -> tuple[Model | None, list[dict[str, Any]]]:
    """Return the specification, or None and pydantic's errors. Errors that empty values cause are left out."""
    try:
        return model.model_validate(tree.plain, by_alias=True, by_name=False), []
    except ValidationError as error:
        errors = [dict(details) for details in error.errors(include_input=False, include_url=False)]
        return None, [details for details in errors if not _is_caused_by_empty_value(tree, details)]


def _problems(
    model: type[BaseModel], tree: MappingNode, errors: list[dict[str, Any]], missing: Sequence[Problem] = ()
) -> list[Problem]:
    """Return the problems of empty values, the problems `missing`, and the problems for pydantic's `errors`."""
    empty = [
        _empty_value_problem(model, tree, keys)
        for keys, node in nodes_with_keys(tree)
        if isinstance(node, ScalarNode) and node.value is None
    ]
    return _without_duplicates([*empty, *missing, *(_problem_for_error(model, tree, error) for error in errors)])


def _is_missing_key(error: dict[str, Any]) -> bool:
    """Return whether an error of pydantic reports a missing key that is not in an item of a list."""
    is_in_list = any(isinstance(part, int) for part in error["loc"])
    return error["type"] in ("missing", "union_tag_not_found") and not is_in_list


def _version_problem(tree: MappingNode) -> Problem | None:
    """Return a problem if the file states another version of the language; else None."""
    version = child(tree, "simscen")
    if version is None or type(version.plain) is not int or version.plain == LANGUAGE_VERSION:
        return None
    message = f"written for language version {version.plain}; this simscen supports {LANGUAGE_VERSION}"
    return Problem(*version.position, "SC009", message)


def _problem_for_error(model: type[BaseModel], tree: Node, error: dict[str, Any]) -> Problem:
    loc: Keys = error["loc"]
    kind: str = error["type"]
    if kind == "extra_forbidden":
        return _unknown_key_problem(model, tree, loc)
    if kind == "missing":
        return _missing_key_problem(tree, loc)
    if kind.startswith("union_tag"):
        return _type_key_problem(model, tree, loc, error)
    if loc and loc[-1] == "[key]":
        name = ScalarNode(tree.position, str(loc[-2]))
        message = messages.translate_error(kind, error.get("ctx", {}), name, error["msg"])
        return Problem(*key_position(tree, loc), *message)
    node = node_at(tree, loc)
    message = messages.translate_error(kind, error.get("ctx", {}), node, error["msg"])
    if not message.hint and kind in ("model_type", "model_attributes_type", "list_type"):
        message = message._replace(hint=common_mistakes.hint_for_wrong_type(kind, model, loc, node))
    elif not message.hint and message.code == "SC013":
        message = message._replace(hint=common_mistakes.hint_for_bounds(model, loc, node))
    if kind == "value_error" and isinstance(node, MappingNode):
        named = (name for name in re.findall(r"`(\w+)`", message.text) if name in node.entries)
        loc = (*loc, *islice(named, 1))  # the first key that the message names
    return Problem(*value_position(tree, loc), *message)


def _unknown_key_problem(model: type[BaseModel], tree: Node, loc: Keys) -> Problem:
    from simscen.triggers.base import AnyCondition, Trigger

    key = str(loc[-1])
    holder = dotted_path(existing_keys(tree, loc[:-1]))
    where = f" in `{holder}`" if holder else ""
    models = models_at(model, loc[:-1])
    if key in Trigger.modifiers and models == [AnyCondition]:
        hint = f"`{key}` applies to the whole trigger: write it next to `all`, `any` or `not` under `when`"
    elif others := type_values_with_key(model, loc[:-1], key):
        hint = f"`{key}` is a parameter of type {' and '.join(f'`{name}`' for name in others)}"
    else:
        hint = (
            lookalike_hint(key)
            or common_mistakes.hint_for_known_mistake(loc[:-1], key)
            or messages.did_you_mean(key, keys_of(models))
            or common_mistakes.hint_for_misplaced_key(model, tree, loc[:-1], key)
        )
    if not hint:
        hint = messages.suggestion(key, keys_of(models))
        if any(issubclass(choice, Choice) and choice.group for choice in models):
            hint = f"{hint}; `simscen plugins` lists what installed packages add".removeprefix("; ")
    return Problem(*key_position(tree, loc), "SC012", f"unknown key {messages.quoted(key)}{where}", hint)


def _missing_key_problem(tree: Node, loc: Keys) -> Problem:
    """Return the problem of the missing key, or the missing item of a list, at the end of `loc`."""
    holder = dotted_path(existing_keys(tree, loc[:-1]))
    if isinstance(loc[-1], int):
        return Problem(*key_position(tree, loc[:-1]), "SC017", f"`{holder}` has too few values: [{loc[-1]}] is missing")
    where = f" in `{holder}`" if holder else ""
    return Problem(*key_position(tree, loc[:-1]), "SC010", f"missing key `{loc[-1]}`{where}")


def _type_key_problem(model: type[BaseModel], tree: Node, loc: Keys, error: dict[str, Any]) -> Problem:
    """Return the problem of a mapping whose `type` is missing or unknown."""
    node, types = node_at(tree, loc), type_values_at(model, loc)
    if not isinstance(node, MappingNode):
        hint = common_mistakes.hint_for_wrong_type("model_type", model, loc, node)
        message = f"expected a mapping, got {messages.describe_node(node)}"
        return Problem(*value_position(tree, loc), "SC011", message, hint)
    if error["type"] == "union_tag_not_found":
        message = f"missing key `type` in `{dotted_path(existing_keys(tree, loc))}`"
        return Problem(*key_position(tree, loc), "SC010", message, f"expected one of: {', '.join(types)}")
    written = str(error["ctx"]["tag"])
    message = f"{messages.quoted(written)} is not one of the choices"
    return Problem(*value_position(tree, (*loc, "type")), "SC014", message, messages.suggestion(written, types))


def _empty_value_problem(model: type[BaseModel], tree: Node, loc: Keys) -> Problem:
    """Return the problem of the empty value at `loc`, such as `off:` instead of `off: {}`."""
    *holder, key = loc
    if isinstance(key, int):
        message = f"item {key + 1} of `{dotted_path(holder)}` is empty"
        return Problem(*key_position(tree, loc), "SC018", message, "remove it")
    models = models_at(model, loc)
    can_be_empty = models and all(has_no_required_keys(option) for option in models)
    hint = f"write `{key}: {{}}`" if can_be_empty else "give it a value or remove the key"
    return Problem(*key_position(tree, loc), "SC018", f"{messages.quoted(key)} has no value", hint)


def _is_caused_by_empty_value(tree: Node, error: dict[str, Any]) -> bool:
    """Return whether an error of pydantic is caused by an empty value, which is reported as a separate problem."""
    node = node_at(tree, error["loc"])
    if isinstance(node, ScalarNode):
        return node.value is None
    has_empty_value = isinstance(node, MappingNode) and any(e.value.plain is None for e in node.entries.values())
    return has_empty_value and error["type"] == "value_error"


def _without_duplicates(problems: list[Problem]) -> list[Problem]:
    """Return one problem for each mistake.

    Pydantic reports a mistake once for each member of a union. It reports a misspelled key also as a missing key.
    """
    first_at: dict[tuple[str, int, int, str], Problem] = {}
    for problem in problems:
        missing_key = problem.message if problem.code == "SC010" else ""
        first_at.setdefault((problem.path, problem.line, problem.col, missing_key), problem)
    spelling_hints = {problem.hint for problem in problems if problem.code == "SC012"}
    return [
        problem
        for problem in first_at.values()
        if problem.code != "SC010"
        or problem.hint
        or f"did you mean {problem.message.split()[2]}?" not in spelling_hints  # the third word is the missing key
    ]
