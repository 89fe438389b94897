"""Go through all of a specification, with where each part of it stands in the file."""

from collections.abc import Callable, Iterator
from functools import cache
from typing import Annotated, Any, get_args, get_origin

from pydantic import BaseModel, RootModel

from simscen.loading.tree import Key
from simscen.spec.quantities import Quantity

Keys = tuple[Key, ...]


def below(
    spec: Any, keys: Keys = (), concerns: Callable[[str], bool] | None = None
) -> Iterator[tuple[Keys, BaseModel]]:
    """Every mapping of a specification, itself included, in the order of its fields.

    What says `robot:` and is about one that does not concern is passed over.
    """
    about = getattr(spec, "robot", None)
    if concerns is not None and isinstance(about, str) and not concerns(about):
        return
    if isinstance(spec, RootModel):
        yield from below(spec.root, keys, concerns)
    elif isinstance(spec, BaseModel):
        yield keys, spec
        for name, field in type(spec).model_fields.items():
            yield from below(getattr(spec, name), (*keys, field.alias or name), concerns)
    elif isinstance(spec, list | tuple):
        for index, item in enumerate(spec):
            yield from below(item, (*keys, index), concerns)
    elif isinstance(spec, dict):
        for key, item in spec.items():
            yield from below(item, (*keys, key), concerns)


def quantities(spec: BaseModel, dimension: str) -> Iterator[tuple[Keys, float]]:
    """The numbers of one dimension in a specification."""
    for keys, part in below(spec):
        for name, key in _measured(type(part), dimension):
            if isinstance(value := getattr(part, name), int | float):
                yield (*keys, key), value


@cache
def _measured(model: type[BaseModel], dimension: str) -> list[tuple[str, str]]:
    """The fields that hold quantities of the dimension, with their keys."""
    return [
        (name, field.alias or name)
        for name, field in model.model_fields.items()
        if any(_has(mark, dimension) for mark in field.metadata) or _measures(field.annotation, dimension)
    ]


def _measures(kind: Any, dimension: str) -> bool:
    """Whether a type, or a member of a union, is a quantity of the dimension."""
    if get_origin(kind) is Annotated:
        inner, *marks = get_args(kind)
        return any(_has(mark, dimension) for mark in marks) or _measures(inner, dimension)
    return any(_measures(member, dimension) for member in get_args(kind))


def _has(mark: Any, dimension: str) -> bool:
    return isinstance(mark, Quantity) and mark.dimension == dimension
