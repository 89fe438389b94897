"""Every value that any file of the language may hold, found by following the types of all models."""

from collections.abc import Iterator
from types import NoneType, UnionType
from typing import Annotated, Any, NamedTuple, Union, get_args, get_origin

from pydantic import BaseModel, RootModel
from pydantic.fields import FieldInfo

from simscen.cli.catalog.json_schema import MODELS
from simscen.model.scenario import CriteriaSpec
from simscen.model.world import RosMapSpec
from simscen.spec.base import LazySpec
from simscen.spec.extensible_union import ExtensibleUnion
from simscen.spec.registry import installed_specs


class Written(NamedTuple):
    """What may stand at a field of a model, inside of its lists and unions: a type, with all marks on the way to it."""

    model: type[BaseModel]
    field: str
    kind: Any
    marks: tuple[Any, ...]

    def __str__(self) -> str:
        return self.model.__name__ + ("" if issubclass(self.model, RootModel) else f".{self.field}")


def every_value() -> Iterator[Written]:
    """All of the language that simscen ships, model by model, each model once."""
    waiting: list[type[BaseModel]] = [*MODELS.values(), CriteriaSpec, RosMapSpec]
    known = set(waiting)
    while waiting:
        model = waiting.pop(0)
        for value in _values(model):
            yield value
            if _is_model(value.kind) and value.kind not in known:
                known.add(value.kind)
                waiting.append(value.kind)


def _values(model: type[BaseModel]) -> Iterator[Written]:
    for name, field in model.model_fields.items():
        for kind, marks in _inside(field.annotation, tuple(_flat(field.metadata))):
            yield Written(model, name, kind, marks)


def _inside(kind: Any, marks: tuple[Any, ...]) -> Iterator[tuple[Any, tuple[Any, ...]]]:
    found = next((mark for mark in marks if isinstance(mark, LazySpec | ExtensibleUnion)), None)
    if found is not None:
        rest = tuple(mark for mark in marks if mark is not found)
        if isinstance(found, LazySpec):
            yield from _inside(found.load(), rest)
        else:
            built_in = [member.load() for member in found.members().values()]
            advanced = installed_specs(found.group, with_plugins=False).values()
            for member in dict.fromkeys([*built_in, *advanced]):
                yield from _inside(member, rest)
    elif get_origin(kind) is Annotated:
        inner, *more = get_args(kind)
        yield from _inside(inner, (*marks, *_flat(more)))
    elif get_origin(kind) in (Union, UnionType, list, tuple, dict):
        for member in get_args(kind):
            if member not in (NoneType, Ellipsis):
                yield from _inside(member, marks)
    else:
        yield kind, marks


def _flat(marks: Any) -> Iterator[Any]:
    """Annotations of pydantic's Field are nested in it."""
    for mark in marks:
        yield from mark.metadata if isinstance(mark, FieldInfo) else [mark]


def _is_model(kind: Any) -> bool:
    return isinstance(kind, type) and issubclass(kind, BaseModel)
