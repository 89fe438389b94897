"""Keys of YAML mappings, with descriptions of their values, for `simscen explain` and the language reference."""

import re
from dataclasses import dataclass
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel, RootModel
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from simscen.core.messages.navigation import ErrorCode
from simscen.model.controllers import Controller, GoalChecker
from simscen.model.localizers import Localizer
from simscen.model.planners import Planner
from simscen.model.stack_files import AnyStack
from simscen.spec.base import Typed, field_docs
from simscen.spec.choice import Choice
from simscen.spec.extensible_union import ExtensibleUnion, TypeName
from simscen.spec.places import PlaceAllowed, PlaceShorthand
from simscen.spec.quantities import UNITS, Amount, Quantity, exact_text
from simscen.spec.registry import all_types

OPTIONAL = "–"
"""Text for the default of an optional key without a default value."""
_KIND_NAMES: dict[Any, str] = {
    int: "integer",
    float: "number",
    str: "text",
    bool: "true or false",
    Amount: "quantity",
    ErrorCode: "error code",
}
_DEFAULT_TYPES = frozenset(
    mark.default
    for union in (AnyStack, Localizer, Planner, Controller, GoalChecker)
    for mark in get_args(union)[1:]
    if isinstance(mark, ExtensibleUnion)
)
"""Default types of components. For these types, the key `type` is optional."""
_BOUNDS = {"gt": ">", "ge": "≥", "lt": "<", "le": "≤"}


@dataclass(frozen=True)
class Field:
    """Key of a YAML mapping.

    key:      name of the key
    kind:     kind of the value, such as "length in m, ≥ 0"
    default:  default value, or OPTIONAL; "" for a required key
    text:     description
    """

    key: str
    kind: str
    default: str
    text: str


def fields_of(model: type[BaseModel]) -> list[Field]:
    """Return the keys of a model in order.

    For a Choice (a mapping with exactly one main key and optional modifiers), return only the modifiers.
    """
    docs = field_docs(model)
    names = model.modifiers if issubclass(model, Choice) else model.model_fields.keys()
    return [
        Field(field.alias or name, kind_of(field), _default(model, name, field), docs.get(name, ""))
        for name, field in model.model_fields.items()
        if name in names
    ]


def kind_of(kind: Any, metadata: tuple[Any, ...] = ()) -> str:
    """Return a description of the values of a type or pydantic field, such as "length in m, ≥ 0".

    `metadata` are the further arguments of `Annotated`.
    """
    if isinstance(kind, FieldInfo):
        return kind_of(kind.annotation, tuple(kind.metadata))
    if mark := next((mark for mark in metadata if isinstance(mark, ExtensibleUnion | TypeName)), None):
        if isinstance(mark, TypeName):
            return _type_names(mark.group)
        return f"{_type_names(mark.group)} or mapping" if mark.allows_names else "mapping"
    if get_origin(kind) is Annotated:
        return kind_of(get_args(kind)[0], (*get_args(kind)[1:], *metadata))
    if place := next((mark for mark in metadata if isinstance(mark, PlaceAllowed | PlaceShorthand)), None):
        keywords = [f"`{word}`" for word in getattr(place, "keywords", ())]
        return " or ".join([*keywords, "place", kind_of(kind, tuple(mark for mark in metadata if mark is not place))])
    if get_origin(kind) in (Union, UnionType):
        return " or ".join(dict.fromkeys(kind_of(member) for member in get_args(kind) if member is not NoneType))
    if get_origin(kind) is Literal:
        return " | ".join(f"`{value}`" for value in get_args(kind))
    if get_origin(kind) is list:
        return f"list of {_plural(kind_of(get_args(kind)[0]))}"
    if get_origin(kind) is dict:
        return f"names, each with {kind_of(get_args(kind)[1])}"
    if isinstance(kind, type) and issubclass(kind, RootModel):
        return kind_of(kind.model_fields["root"])
    return _simple_kind(kind, metadata)


def _type_names(group: str) -> str:
    """Return the names of the types that simscen ships in a registry group."""
    return " | ".join(f"`{entry.name}`" for entry in all_types(group) if entry.is_shipped)


_NOUN = re.compile(r"(?P<noun>[a-z ]+?)(?P<unit> in [^,]+)?(?P<range>, .+)?")
_WITHOUT_PLURAL = frozenset({"text", "names", "true", "false"})


def _plural(kind: str) -> str:
    """Return the plural of a description, such as "lengths in m, each ≥ 0"."""
    if " or " in kind:
        return " or ".join(map(_plural, kind.split(" or ")))
    if kind.startswith("list of "):
        return kind.replace("list", "lists", 1)
    match = _NOUN.fullmatch(kind)
    if match is None or match["noun"] in _WITHOUT_PLURAL:
        return kind
    bounds = f", each{match['range'][1:]}" if match["range"] else ""
    return f"{match['noun']}s{match['unit'] or ''}{bounds}"


def _simple_kind(kind: Any, metadata: tuple[Any, ...]) -> str:
    """Return the description of a type that is neither a union nor a list, with the bounds of its values."""
    # A FieldInfo has its constraints in its own metadata.
    marks = [inner for mark in metadata for inner in (mark.metadata if isinstance(mark, FieldInfo) else [mark])]
    quantity = next((mark for mark in marks if isinstance(mark, Quantity)), None)
    if quantity is not None:
        text = f"{quantity.dimension} in {next(iter(UNITS[quantity.dimension]))}"
    elif get_origin(kind) is tuple:
        text = f"list of {len(get_args(kind))} values"
    elif isinstance(kind, type) and issubclass(kind, BaseModel):
        text = "mapping"
    else:
        text = _KIND_NAMES.get(kind, "value")
    found = {name: getattr(mark, name, None) for mark in marks for name in _BOUNDS if hasattr(mark, name)}
    bounds = {name: bound for name, bound in found.items() if bound is not None}
    if {"gt", "ge"} <= bounds.keys():  # the stricter one applies
        del bounds["ge" if bounds["gt"] >= bounds["ge"] else "gt"]
    units = {} if quantity is None else UNITS[quantity.dimension]
    smallest_first = {"": 1.0, **dict(sorted(units.items(), key=lambda unit: unit[1]))}
    numbers = {name: exact_text(bound, smallest_first) for name, bound in bounds.items()}
    if bounds.keys() == {"ge", "le"}:
        texts = [f"{numbers['ge']} … {numbers['le']}"]
    else:
        texts = [f"{_BOUNDS[name]} {number}" for name, number in numbers.items()]
    return ", ".join([text.replace("ratio in %", "ratio"), *texts])


def _default(model: type[BaseModel], name: str, field: FieldInfo) -> str:
    """Return the default value of a key as in the attribute `default` of Field."""
    selects_model = name == "type" and issubclass(model, Typed)
    if field.is_required() or (selects_model and field.default not in _DEFAULT_TYPES):
        return ""
    value = field.get_default(call_default_factory=True)
    if value in (PydanticUndefined, None, "") or isinstance(value, BaseModel | dict):
        return OPTIONAL
    if isinstance(value, list | tuple):
        return f"[{', '.join(map(str, value))}]" if value else OPTIONAL
    if isinstance(value, float):
        return f"{value:.0f}" if value.is_integer() else f"{value:g}"
    return str(value).lower() if isinstance(value, bool) else str(value)
