"""Looks up the pydantic models, and the keys of these models, that are possible at a location in a YAML file.

A `loc` is the location of a validation error in pydantic: keys and list indices, with tags of union members between
them. A `kind` is a type annotation. Models of installed packages are included.
"""

from collections.abc import Iterable, Sequence
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel, RootModel, Tag

from simscen.loading.yaml.tree import Key
from simscen.spec.base import LazySpec, annotation_of
from simscen.spec.choice import Choice, with_installed_choices
from simscen.spec.extensible_union import ExtensibleUnion
from simscen.spec.registry import BrokenPlugin, installed_specs


def models_at(model: type[BaseModel], loc: Sequence[Key]) -> list[type[BaseModel]]:
    """Return the possible models of the mapping at `loc`; `model` is the model of the whole file."""
    candidates: list[Any] = [model]
    for part in loc:
        options = [option for candidate in candidates for option in _union_members(candidate)]
        matches = [kind for option in options for kind in _types_below(option, part)]
        narrowed = [option for option in options if part in _tags(option)]
        candidates = matches or narrowed or candidates
    found = [_unwrapped(option) for candidate in candidates for option in _union_members(candidate)]
    return list(dict.fromkeys(kind for kind in found if _is_model(kind) and not issubclass(kind, RootModel)))


def type_values_at(model: type[BaseModel], loc: Sequence[Key]) -> list[str]:
    """Return the valid values of the key `type` in the mapping at `loc`."""
    return [str(value) for kind in models_at(model, loc) for value in _type_values(kind)]


def type_values_with_key(model: type[BaseModel], loc: Sequence[Key], key: str) -> list[str]:
    """Return the other values of `type` with which `key` would be valid in the mapping at `loc`."""
    current = type_values_at(model, loc)
    if not loc or loc[-1] not in current:
        return []
    models_with_key = [kind for kind in models_at(model, loc[:-1]) if key in keys_of([kind])]
    return [name for kind in models_with_key for name in map(str, _type_values(kind)) if name not in current]


def keys_of(models: Iterable[type[BaseModel]]) -> list[str]:
    """Return the keys in YAML of all these models."""
    keys = [field.alias or name for model in models for name, field in model.model_fields.items()]
    return list(dict.fromkeys(keys))


def has_no_required_keys(model: type[BaseModel]) -> bool:
    """Return whether the empty mapping `{}` is valid for a model."""
    return not issubclass(model, RootModel | Choice) and not any(f.is_required() for f in model.model_fields.values())


def _field_type(model: type[BaseModel], key: str) -> Any:
    """Return the type of the field with this key in YAML; None if the key is unknown or the type cannot be imported."""
    field = next((field for name, field in model.model_fields.items() if key in (field.alias, name)), None)
    if field is None:
        return None
    if mark := next((mark for mark in field.metadata if isinstance(mark, ExtensibleUnion)), None):
        return Annotated[field.annotation, mark]
    try:
        return annotation_of(field)
    except BrokenPlugin:
        return None


def _union_members(kind: Any) -> list[Any]:
    """Return the members of a union; for any other type, the type itself."""
    if mark := next((mark for mark in _metadata(kind) if isinstance(mark, ExtensibleUnion)), None):
        built_in = {tag: member.load() for tag, member in mark.members().items()}
        return [Annotated[model, Tag(tag)] for tag, model in {**built_in, **installed_specs(mark.group)}.items()]
    unwrapped = _unwrapped(kind)
    if get_origin(unwrapped) in (Union, UnionType):
        return [option for member in get_args(unwrapped) if member is not NoneType for option in _union_members(member)]
    if _is_model(unwrapped) and issubclass(unwrapped, RootModel):
        inner = _unwrapped(unwrapped.model_fields["root"].annotation)
        contains_models = _is_model(inner) or get_origin(inner) in (Union, UnionType)
        return _union_members(unwrapped.model_fields["root"].annotation) if contains_models else [kind]
    return [kind]


def _types_below(kind: Any, part: Key) -> list[Any]:
    """Return the possible types of the value at the key or index `part` of a value of type `kind`."""
    unwrapped = _unwrapped(kind)
    if _is_model(unwrapped) and isinstance(part, str):
        matches = _field_type(unwrapped, part)
        return [] if matches is None else [matches]
    if get_origin(unwrapped) is list and isinstance(part, int):
        return [get_args(unwrapped)[0]]
    if get_origin(unwrapped) is dict and part not in _tags(kind):
        return [get_args(unwrapped)[1]]
    return []


def _tags(option: Any) -> set[str]:
    """Return the tags that a `loc` can contain for this member of a union."""
    tags = {meta.tag for meta in _metadata(option) if isinstance(meta, Tag)}
    unwrapped = _unwrapped(option)
    if _is_model(unwrapped):
        tags |= {unwrapped.__name__, *(str(value) for value in _type_values(unwrapped))}
    return tags


def _type_values(model: type[BaseModel]) -> tuple[Any, ...]:
    """Return the valid values of the key `type` of a model; () if it has no such key."""
    field = model.model_fields.get("type")
    return get_args(field.annotation) if field is not None and get_origin(field.annotation) is Literal else ()


def _metadata(kind: Any) -> tuple[Any, ...]:
    return tuple(get_args(kind)[1:]) if get_origin(kind) is Annotated else ()


def _unwrapped(kind: Any) -> Any:
    """Return the type inside `Annotated`. A LazySpec is imported, and a Choice is extended by installed packages."""
    while get_origin(kind) is Annotated:
        kind = next((mark.load() for mark in _metadata(kind) if isinstance(mark, LazySpec)), get_args(kind)[0])
    return with_installed_choices(kind) if _is_model(kind) and issubclass(kind, Choice) else kind


def _is_model(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, BaseModel)
