"""Search of a specification for nested specifications, references by name, and angles, with their YAML keys."""

from collections.abc import Callable, Iterable, Iterator
from functools import cache
from types import UnionType
from typing import Annotated, Any, NamedTuple, Union, get_args, get_origin

from pydantic import BaseModel, RootModel

from simscen.loading.yaml.tree import Key, Keys
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


def references(spec: BaseModel, includes_robot: RobotFilter | None = None) -> Iterator[Reference]:
    """Yield all references in `spec`.

    Parts that name a robot are left out if `includes_robot` is false for it; None includes all parts.
    """
    for keys, part in _walk_with_roots(spec, (), includes_robot):
        for name, key, annotation in _reference_fields(type(part)):
            below = keys if isinstance(part, RootModel) else (*keys, key)
            for text_keys, text in _texts(getattr(part, name), below):
                if not isinstance(annotation, PlaceAllowed) or text not in annotation.keywords:
                    yield Reference(text_keys, annotation, text)


@cache
def _reference_fields(model: type[BaseModel]) -> list[tuple[str, str, ReferenceTo]]:
    """Return the name, the YAML key, and the first ReferenceTo annotation of each field that has one."""
    found: list[tuple[str, str, ReferenceTo]] = []
    for name, field in model.model_fields.items():
        annotations = (*field.metadata, *_annotations(field.annotation))
        found += [(name, field.alias or name, mark) for mark in annotations if isinstance(mark, ReferenceTo)][:1]
    return found


def _texts(value: Any, keys: Keys) -> Iterator[tuple[Keys, str]]:
    """Yield all texts in nested lists and dicts, with their keys. `keys` are the keys of `value`."""
    if isinstance(value, str):
        yield keys, value
    elif isinstance(value, list | dict):
        for key, item in value.items() if isinstance(value, dict) else enumerate(value):
            yield from _texts(item, (*keys, key))


def walk(
    spec: BaseModel | dict[str, Any], includes_robot: RobotFilter | None = None
) -> Iterator[tuple[Keys, BaseModel]]:
    """Yield a specification and all specifications in it with their keys. A RootModel itself is not yielded.

    Parts that name a robot are left out if `includes_robot` is false for it; None includes all parts.
    """
    parts = _walk_with_roots(spec, (), includes_robot)
    return ((keys, part) for keys, part in parts if not isinstance(part, RootModel))


def _walk_with_roots(spec: Any, keys: Keys, includes_robot: RobotFilter | None) -> Iterator[tuple[Keys, BaseModel]]:
    """Yield the same as `walk`, and each RootModel. `keys` are the keys of `spec`."""
    parts: Iterable[tuple[Key, Any]]
    if isinstance(spec, BaseModel):
        if includes_robot is not None:
            robot = getattr(spec, "robot", None)
            if isinstance(robot, str) and not includes_robot(robot):
                return
        yield keys, spec
        parts = [(key, getattr(spec, name)) for name, key in _keys_by_field(type(spec))]
    else:
        parts = spec.items() if isinstance(spec, dict) else enumerate(spec)
    for key, part in parts:
        if isinstance(part, BaseModel | list | tuple | dict):
            yield from _walk_with_roots(part, keys if isinstance(spec, RootModel) else (*keys, key), includes_robot)


@cache
def _keys_by_field(model: type[BaseModel]) -> list[tuple[str, str]]:
    """Return the name and the YAML key of each field."""
    return [(name, field.alias or name) for name, field in model.model_fields.items()]


def angles_of(spec: BaseModel) -> Iterator[tuple[Keys, float]]:
    """Yield the keys and values in rad of all angles, including those in lists, such as the yaw of keyframes."""
    for keys, part in walk(spec):
        for name, key, kind in _fields_with_angles(type(part)):
            yield from _angles_in(getattr(part, name), kind, (*keys, key))


@cache
def _fields_with_angles(model: type[BaseModel]) -> list[tuple[str, str, Any]]:
    """Return the name, the YAML key, and the type of each field that is an angle or contains one."""
    fields = [(name, field.alias or name, field.rebuild_annotation()) for name, field in model.model_fields.items()]
    return [(name, key, kind) for name, key, kind in fields if any(map(_is_angle, _annotations(kind)))]


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
