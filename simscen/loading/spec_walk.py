"""Searches a specification for nested specifications, references by name, and angles, with their YAML keys."""

from collections.abc import Callable, Iterator
from functools import cache
from types import UnionType
from typing import Annotated, Any, NamedTuple, Union, get_args, get_origin

from pydantic import BaseModel, RootModel

from simscen.loading.yaml.tree import Key, Keys
from simscen.spec.places import PlaceAllowed, ReferenceTo
from simscen.spec.quantities import Quantity

RobotFilter = Callable[[str], bool]
"""Function that returns whether to search the parts that name a robot. Its argument is the name of the robot."""


class Reference(NamedTuple):
    """Name in a specification that refers to an entry, such as the name of a door.

    `keys` lead to the name in the scenario. `annotation` is the annotation of the field with the name.
    """

    keys: Keys
    annotation: ReferenceTo
    name: str

    @property
    def target(self) -> str:
        """Kind of entry that the name refers to, e.g. "door" (see `ReferenceTo`)."""
        return self.annotation.target


def walk(spec: Any, includes_robot: RobotFilter | None = None, keys: Keys = ()) -> Iterator[tuple[Keys, BaseModel]]:
    """Yield a specification and all specifications in it, with their keys. `keys` are the keys of `spec`.

    `spec` can also be a list or dict. Parts that name a robot are left out if `includes_robot` is false for this robot.
    """
    parts: list[tuple[Keys, Any]]
    if isinstance(spec, BaseModel):
        robot = getattr(spec, "robot", None)
        if includes_robot is not None and isinstance(robot, str) and not includes_robot(robot):
            return
        yield keys, spec
        parts = [(below, getattr(spec, name)) for name, below, _ in _fields(type(spec))]
    else:
        parts = [((key,), part) for key, part in _items(spec)]
    for below, part in parts:
        if isinstance(part, BaseModel | list | tuple | dict):
            yield from walk(part, includes_robot, (*keys, *below))


@cache
def _fields(model: type[BaseModel]) -> list[tuple[str, Keys, Any]]:
    """Return the name, the keys in YAML, and the type of each field. The field of a RootModel has no key."""
    is_root = issubclass(model, RootModel)
    return [
        (name, () if is_root else (field.alias or name,), field.rebuild_annotation())
        for name, field in model.model_fields.items()
    ]


def _items(value: list[Any] | tuple[Any, ...] | dict[str, Any]) -> Iterator[tuple[Key, Any]]:
    yield from value.items() if isinstance(value, dict) else enumerate(value)


def references(spec: BaseModel, includes_robot: RobotFilter | None = None) -> Iterator[Reference]:
    """Yield all references in `spec`. `includes_robot` selects parts as in `walk`."""
    for keys, part in walk(spec, includes_robot):
        for name, below, annotation in _reference_fields(type(part)):
            for text_keys, text in _texts(getattr(part, name), (*keys, *below)):
                if not isinstance(annotation, PlaceAllowed) or text not in annotation.keywords:
                    yield Reference(text_keys, annotation, text)


@cache
def _reference_fields(model: type[BaseModel]) -> list[tuple[str, Keys, ReferenceTo]]:
    """Return the name, the keys in YAML, and the first ReferenceTo annotation of each field that has one."""
    return [
        (name, keys, annotation)
        for name, keys, kind in _fields(model)
        for annotation in [item for item in _annotations(kind) if isinstance(item, ReferenceTo)][:1]
    ]


def _texts(value: Any, keys: Keys) -> Iterator[tuple[Keys, str]]:
    """Yield all texts in nested lists and dicts, with their keys. `keys` are the keys of `value`."""
    if isinstance(value, str):
        yield keys, value
    elif isinstance(value, list | dict):
        for key, item in _items(value):
            yield from _texts(item, (*keys, key))


def angles_of(spec: BaseModel) -> Iterator[tuple[Keys, float]]:
    """Yield the keys and values in rad of all angles, including those in lists, such as the yaw of keyframes."""
    for keys, part in walk(spec):
        for name, below, kind in fields_with_angles(type(part)):
            yield from _angles_in(getattr(part, name), kind, (*keys, *below))


@cache
def fields_with_angles(model: type[BaseModel]) -> list[tuple[str, Keys, Any]]:
    """Return the name, the keys in YAML, and the type of each field that is an angle or contains one."""
    return [found for found in _fields(model) if any(map(_is_angle, _annotations(found[2])))]


def _is_angle(annotation: Any) -> bool:
    return isinstance(annotation, Quantity) and annotation.dimension == "angle"


def _angles_in(value: Any, kind: Any, keys: Keys) -> Iterator[tuple[Keys, float]]:
    """Yield the keys and values in rad of all angles in a value of type `kind`, a number or nested lists."""
    kind, *annotations = get_args(kind) if get_origin(kind) is Annotated else (kind,)
    if isinstance(value, int | float) and any(map(_is_angle, annotations)):
        yield keys, value
    elif get_origin(kind) in (list, tuple) and isinstance(value, list | tuple):
        kinds = get_args(kind) * (len(value) if get_origin(kind) is list else 1)
        for index, (item, item_kind) in enumerate(zip(value, kinds, strict=True)):
            yield from _angles_in(item, item_kind, (*keys, index))
    elif get_origin(kind) in (Union, UnionType):
        for member in get_args(kind):
            yield from _angles_in(value, member, keys)


def _annotations(kind: Any) -> Iterator[Any]:
    """Yield the annotations of a type, of the members of a union, and of the items of lists."""
    if get_origin(kind) is Annotated:
        kind, *annotations = get_args(kind)
        yield from annotations
    for member in get_args(kind):
        yield from _annotations(member)
