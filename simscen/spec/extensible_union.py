"""Annotations of fields that accept all types of a registry group, such as planners, including those of packages."""

import math
from collections.abc import Hashable
from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import BaseModel, GetCoreSchemaHandler
from pydantic_core import CoreSchema, InitErrorDetails, PydanticCustomError, ValidationError, core_schema

from simscen.core.messages.navigation import RecoveryBehavior
from simscen.spec.base import LazySpec, Typed, text_or_mapping
from simscen.spec.registry import BrokenPlugin, RegisteredType, all_types, built_in_types, find_type

GROUP_KEY = "simscen group"
"""Key in the metadata of a pydantic schema: the value is the name of the registry group."""
NAMES_ALLOWED_KEY = "simscen names"
"""Key in the same metadata: the value is True if the name of a type alone is valid."""
MAPPINGS_ALLOWED_KEY = "simscen mappings"
"""Key in the same metadata: the value is True if a mapping with the key `type` is valid."""
UNTYPED_TAG = "without type"
"""Union tag of mappings without `type`. Locations of validation errors contain it, so it must not be a key in YAML."""


@dataclass(frozen=True)
class ExtensibleUnion:
    """Annotation of a field with a specification of a registry group. The key `type` selects the specification.

    The module of a specification is imported when a value of this type is validated.
    """

    group: str
    default: str = ""
    """Type of a mapping without the key `type`; "" if the key is required."""
    allows_names: bool = False
    """Whether the name of a type alone is also valid."""
    untyped_key: str = ""
    """Key that a mapping can have instead of `type`, such as `external`; "" if all mappings have a type."""
    untyped: LazySpec | None = None
    """Specification of mappings with `untyped_key`."""

    def members(self) -> dict[str, LazySpec]:
        """Return the specifications of the built-in types by type, and `untyped` under UNTYPED_TAG."""
        members = {entry.name: LazySpec(*entry.value.split(":")) for entry in built_in_types(self.group)}
        return members if self.untyped is None else {**members, UNTYPED_TAG: self.untyped}

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        members: dict[Hashable, CoreSchema] = {}
        for tag, member in self.members().items():
            members[tag] = handler.generate_schema(Annotated[BaseModel, member])
        union: CoreSchema = core_schema.tagged_union_schema(members, self._tag)
        if self.allows_names:
            names = core_schema.literal_schema([entry.name for entry in built_in_types(self.group)])
            options: dict[Hashable, CoreSchema] = {"a text": names, "a mapping": union}
            union = core_schema.tagged_union_schema(options, text_or_mapping)
        metadata = {GROUP_KEY: self.group, NAMES_ALLOWED_KEY: self.allows_names, MAPPINGS_ALLOWED_KEY: True}
        serialization = core_schema.simple_ser_schema("any")  # specifications of plug-ins are no members of the union
        return core_schema.no_info_wrap_validator_function(
            self._validate, union, metadata=metadata, serialization=serialization
        )

    def _tag(self, value: Any) -> str | None:
        """Return the key in `members` for a value; None if its type is missing."""
        if isinstance(value, dict):
            is_untyped = self.untyped is not None and self.untyped_key in value and "type" not in value
            return UNTYPED_TAG if is_untyped else str(value.get("type", self.default)) or None
        return getattr(value, "type", None) or (UNTYPED_TAG if isinstance(value, BaseModel) else None)

    def _validate(self, value: Any, validate_built_in: core_schema.ValidatorFunctionWrapHandler) -> Any:
        """Return the specification of a value, validated by the built-in union or by a plug-in."""
        if isinstance(value, Typed) and value.type not in _built_in_names(self.group):
            return value
        if self.allows_names and isinstance(value, str) and value not in _built_in_names(self.group):
            return validate_plugin_spec(_find_or_raise(self.group, value), {"type": value})
        name = value.get("type") if isinstance(value, dict) else None
        if not isinstance(name, str) or name in _built_in_names(self.group):
            return validate_built_in(value)
        entry = find_type(self.group, name)
        if entry is not None:
            return validate_plugin_spec(entry, value)
        details = InitErrorDetails(type=_unknown_type_error(self.group, name), loc=("type",), input=name)
        raise ValidationError.from_exception_data("type", [details])


@dataclass(frozen=True)
class TypeName:
    """Annotation of a string that names a type of a registry group, built-in or from an installed package."""

    group: str

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        metadata = {GROUP_KEY: self.group, NAMES_ALLOWED_KEY: True, MAPPINGS_ALLOWED_KEY: False}
        return core_schema.no_info_wrap_validator_function(self._validate, handler(source), metadata=metadata)

    def _validate(self, value: Any, validate_built_in: core_schema.ValidatorFunctionWrapHandler) -> Any:
        """Return the name. Raises PydanticCustomError if there is no such type."""
        if isinstance(value, str) and value not in _built_in_names(self.group):
            return _find_or_raise(self.group, value).name
        return validate_built_in(value)


BehaviorName = Annotated[RecoveryBehavior, TypeName("behavior")]
"""Name of a recovery behavior, built-in or from an installed package."""


def _built_in_names(group: str) -> frozenset[str]:
    return frozenset(entry.name for entry in built_in_types(group))


def _find_or_raise(group: str, name: str) -> RegisteredType:
    if (entry := find_type(group, name)) is None:
        raise _unknown_type_error(group, name)
    return entry


def _unknown_type_error(group: str, name: str) -> PydanticCustomError:
    names = dict.fromkeys(entry.name for entry in all_types(group))  # two packages can add the same name
    return PydanticCustomError("unknown_type", "no such type", {"value": name, "names": ", ".join(names)})


_CHECKED_PROPERTIES = ("horizon", "clearance_range")
"""Properties of specifications that are read before a run: a time in s, and a distance in m."""


@dataclass(frozen=True)
class PluginSpec(LazySpec):
    """Annotation of a field with a specification of a plug-in."""

    entry: RegisteredType

    def load(self) -> type[BaseModel]:
        """Import the package and return the specification class. Raises BrokenPlugin."""
        return self.entry.load()

    def _validate(self, value: Any) -> BaseModel:
        return validate_plugin_spec(self.entry, value)


def validate_plugin_spec(entry: RegisteredType, value: Any) -> BaseModel:
    """Return the specification of `value`, validated by the class of a plug-in type.

    Exceptions of the plug-in become validation errors.
    """
    try:
        return _with_valid_properties(entry, entry.load().model_validate(value, by_alias=True, by_name=False))
    except BrokenPlugin as broken:
        raise _plugin_error(broken) from broken
    except (ValueError, AssertionError):  # pydantic reports these as mistakes in the file
        raise
    except Exception as error:  # code of other packages can raise anything
        reason = f"its validation raises {type(error).__name__}: {error}"
        raise _plugin_error(BrokenPlugin(entry, reason)) from error


def _plugin_error(broken: BrokenPlugin) -> PydanticCustomError:
    return PydanticCustomError("plugin", "{problem}", {"problem": str(broken), "hint": broken.hint})


def _with_valid_properties(entry: RegisteredType, spec: BaseModel) -> BaseModel:
    """Return `spec`. Raises BrokenPlugin if a checked property is not a finite number of at least 0."""
    for name in _CHECKED_PROPERTIES:
        number = getattr(spec, name) if hasattr(type(spec), name) else 0.0
        if isinstance(number, bool) or not isinstance(number, int | float) or not (0 <= number < math.inf):
            raise BrokenPlugin(entry, f"its `{name}` is {number!r} instead of a finite number of at least 0")
    return spec
