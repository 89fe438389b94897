"""Validate a tree against a model: the model, or every problem at the line and column to mend."""

from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from simscen.core.problems import Problem
from simscen.loading import messages
from simscen.loading.grammar import keys_of, models_at, needs_nothing, types_at
from simscen.loading.tree import Fields, Key, Leaf, Node, Place, at, child, dotted, key_place, real_keys, value_place
from simscen.spec.base import Choice

Model = TypeVar("Model", bound=BaseModel)
VERSION = 1


def check(model: type[Model], tree: Node) -> Model | list[Problem]:
    """The specification that `tree` holds, or all that is wrong with it."""
    if not isinstance(tree, Fields):
        return [_problem(tree.place, "SC004", f"expected a mapping at top level, got {messages.found(tree)}")]
    if problem := _other_version(tree):
        return [problem]
    try:
        return model.model_validate(tree.plain, by_alias=True, by_name=False)
    except ValidationError as error:
        found = [_translate(model, tree, dict(e)) for e in error.errors(include_input=False, include_url=False)]
        return _distinct(found)


def _other_version(tree: Fields) -> Problem | None:
    version = child(tree, "simscen")
    if not isinstance(version, Leaf) or version.value == VERSION or isinstance(version.value, bool):
        return None
    if not isinstance(version.value, int):
        return None
    message = f"needs schema {version.value}; this version of simscen supports {VERSION}"
    return _problem(version.place, "SC009", message)


def _translate(model: type[BaseModel], tree: Node, error: dict[str, Any]) -> Problem:
    loc: tuple[Key, ...] = error["loc"]
    kind: str = error["type"]
    if kind == "extra_forbidden":
        return _unknown_key(model, tree, loc)
    if kind == "missing":
        return _missing_key(tree, loc)
    if kind.startswith("union_tag"):
        return _wrong_type(model, tree, loc, error)
    if loc and loc[-1] == "[key]":
        name = Leaf(tree.place, str(loc[-2]))
        return _problem(key_place(tree, loc), *messages.explain(kind, error.get("ctx", {}), name, error["msg"]))
    node = at(tree, loc)
    if kind == "value_error" and (empty := _empty_choice(model, node, loc)):
        return empty
    return _problem(value_place(tree, loc), *messages.explain(kind, error.get("ctx", {}), node, error["msg"]))


def _unknown_key(model: type[BaseModel], tree: Node, loc: tuple[Key, ...]) -> Problem:
    key = str(loc[-1])
    holder = dotted(real_keys(tree, loc[:-1]))
    where = f" in `{holder}`" if holder else ""
    hint = messages.suggestion(key, keys_of(models_at(model, loc[:-1])))
    return _problem(key_place(tree, loc), "SC012", f"unknown key {messages.quoted(key)}{where}", hint)


def _missing_key(tree: Node, loc: tuple[Key, ...]) -> Problem:
    holder = dotted(real_keys(tree, loc[:-1]))
    where = f" in `{holder}`" if holder else ""
    return _problem(key_place(tree, loc[:-1]), "SC010", f"missing key `{loc[-1]}`{where}")


def _wrong_type(model: type[BaseModel], tree: Node, loc: tuple[Key, ...], error: dict[str, Any]) -> Problem:
    """A union told apart by `type:` whose type is missing or unknown."""
    node, types = at(tree, loc), types_at(model, loc)
    if not isinstance(node, Fields):
        return _problem(value_place(tree, loc), "SC011", f"expected a mapping, got {messages.found(node)}")
    if error["type"] == "union_tag_not_found":
        message = f"missing key `type` in `{dotted(real_keys(tree, loc))}`"
        return _problem(key_place(tree, loc), "SC010", message, f"expected one of: {', '.join(types)}")
    written = str(error["ctx"]["tag"])
    message = f"{messages.quoted(written)} is not one of the choices"
    return _problem(value_place(tree, (*loc, "type")), "SC014", message, messages.suggestion(written, types))


def _empty_choice(model: type[BaseModel], node: Node, loc: tuple[Key, ...]) -> Problem | None:
    """`off:` with nothing behind it, where `off: {}` was meant."""
    if not isinstance(node, Fields):
        return None
    for choice in (kind for kind in models_at(model, loc) if issubclass(kind, Choice)):
        for key in choice.choices():
            entry = node.entries.get(key)
            if entry is not None and isinstance(entry.value, Leaf) and entry.value.value is None:
                below = models_at(choice, (key,))
                hint = f"write `{key}: {{}}`" if below and needs_nothing(below[0]) else f"give `{key}` a value"
                return _problem(entry.key, "SC011", f"`{key}` has no value", hint)
    return None


def _distinct(problems: list[Problem]) -> list[Problem]:
    """One problem for one mistake: members of a union complain at one place, and a misspelt key is also missing."""
    places: dict[tuple[str, int, int, str], Problem] = {}
    for problem in problems:
        key = problem.code if problem.code == "SC010" else ""
        places.setdefault((problem.path, problem.line, problem.col, key and problem.message), problem)
    misspelt = {problem.hint for problem in problems if problem.code == "SC012"}
    return [p for p in places.values() if not (p.code == "SC010" and p.hint == "" and _meant(p) in misspelt)]


def _meant(missing: Problem) -> str:
    return f"did you mean {missing.message.split()[2]}?"


def _problem(place: Place, code: str, message: str, hint: str = "") -> Problem:
    return Problem(place.path, place.line, place.col, code, message, hint)
