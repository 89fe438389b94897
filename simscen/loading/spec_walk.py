"""Search of a specification for nested specifications, references by name, and quantities, with their YAML keys."""

from collections.abc import Callable, Iterator
from functools import cache
from typing import Annotated, Any, NamedTuple, get_args, get_origin

from pydantic import BaseModel, RootModel

from simscen.loading.yaml.tree import Keys
from simscen.spec.places import PlaceAllowed, ReferenceTo
from simscen.spec.quantities import Quantity


class Reference(NamedTuple):
    """Name in a specification that refers to a thing, the keys that lead to it, and the annotation of its field."""

    keys: Keys
    annotation: ReferenceTo
    name: str

    @property
    def target(self) -> str:
        """The kind of thing that the name refers to, e.g. "door"."""
        return self.annotation.target


RobotFilter = Callable[[str], bool]
"""Function that returns whether to search the parts that name a robot. Its argument is the name of the robot."""


def references(spec: BaseModel, keys: Keys = (), includes_robot: RobotFilter | None = None) -> Iterator[Reference]:
    """Yield all references in `spec`. `keys` are the keys of `spec` itself.

    Parts that name a robot are left out if `includes_robot` is false for it; None includes all parts.
    """
    robot = getattr(spec, "robot", None)
    if includes_robot is not None and isinstance(robot, str) and not includes_robot(robot):
        return
    for name, key, annotation in _fields_with_annotations(type(spec)):
        below = keys if isinstance(spec, RootModel) else (*keys, key)
        yield from _references_in(getattr(spec, name), annotation, below, includes_robot)


@cache
def _fields_with_annotations(model: type[BaseModel]) -> list[tuple[str, str, ReferenceTo | None]]:
    """Return the name, the YAML key, and the ReferenceTo annotation of each field; None for a field without one."""
    found = []
    for name, field in model.model_fields.items():
        annotations = [annotation for annotation in field.metadata if isinstance(annotation, ReferenceTo)]
        found.append(
            (name, field.alias or name, annotations[0] if annotations else _reference_annotation(field.annotation))
        )
    return found


def _references_in(
    value: Any, annotation: ReferenceTo | None, keys: Keys, includes_robot: RobotFilter | None
) -> Iterator[Reference]:
    """Yield the references in the value of a field with this annotation."""
    if isinstance(value, BaseModel):
        yield from references(value, keys, includes_robot)
    elif isinstance(value, list):
        for index, item in enumerate(value):
            yield from _references_in(item, annotation, (*keys, index), includes_robot)
    elif isinstance(value, dict):
        for key, item in value.items():
            yield from _references_in(item, annotation, (*keys, key), includes_robot)
    elif (
        isinstance(value, str)
        and annotation is not None
        and not (isinstance(annotation, PlaceAllowed) and value in annotation.keywords)
    ):
        yield Reference(keys, annotation, value)


def _reference_annotation(kind: Any) -> ReferenceTo | None:
    """Return the first ReferenceTo annotation in a type, its union members, or its list items; None without one."""
    if get_origin(kind) is Annotated:
        annotations = [annotation for annotation in get_args(kind)[1:] if isinstance(annotation, ReferenceTo)]
        if annotations:
            return annotations[0]
        return _reference_annotation(get_args(kind)[0])
    return next((found for member in get_args(kind) if (found := _reference_annotation(member))), None)


def walk(spec: Any, keys: Keys = (), includes_robot: RobotFilter | None = None) -> Iterator[tuple[Keys, BaseModel]]:
    """Yield a specification and all specifications in it with their keys. `keys` are the keys of `spec` itself.

    A RootModel itself is not yielded. Parts that name a robot are left out if `includes_robot` is false for it; None
    includes all parts.
    """
    robot = getattr(spec, "robot", None)
    if includes_robot is not None and isinstance(robot, str) and not includes_robot(robot):
        return
    if isinstance(spec, RootModel):
        yield from walk(spec.root, keys, includes_robot)
    elif isinstance(spec, BaseModel):
        yield keys, spec
        for name, field in type(spec).model_fields.items():
            yield from walk(getattr(spec, name), (*keys, field.alias or name), includes_robot)
    elif isinstance(spec, list | tuple):
        for index, item in enumerate(spec):
            yield from walk(item, (*keys, index), includes_robot)
    elif isinstance(spec, dict):
        for key, item in spec.items():
            yield from walk(item, (*keys, key), includes_robot)


def quantities_of(spec: BaseModel, dimension: str) -> Iterator[tuple[Keys, float]]:
    """Yield the keys and values of all quantities of one dimension, such as "angle", in SI units."""
    for keys, part in walk(spec):
        for name, key in _quantity_fields(type(part), dimension):
            if isinstance(value := getattr(part, name), int | float):
                yield (*keys, key), value


@cache
def _quantity_fields(model: type[BaseModel], dimension: str) -> list[tuple[str, str]]:
    """Return the name and the YAML key of each field that is a quantity of the dimension."""
    return [
        (name, field.alias or name)
        for name, field in model.model_fields.items()
        if any(_has_dimension(annotation, dimension) for annotation in field.metadata)
        or _is_quantity(field.annotation, dimension)
    ]


def _is_quantity(kind: Any, dimension: str) -> bool:
    """Return whether a type, or a member of a union, is a quantity of the dimension."""
    if get_origin(kind) is Annotated:
        inner, *annotations = get_args(kind)
        return any(_has_dimension(annotation, dimension) for annotation in annotations) or _is_quantity(
            inner, dimension
        )
    return any(_is_quantity(member, dimension) for member in get_args(kind))


def _has_dimension(annotation: Any, dimension: str) -> bool:
    return isinstance(annotation, Quantity) and annotation.dimension == dimension
