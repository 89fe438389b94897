"""Mappings that are told apart by their `type`: what simscen ships, or what an installed package adds."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import BaseModel, GetCoreSchemaHandler
from pydantic_core import CoreSchema, InitErrorDetails, PydanticCustomError, ValidationError, core_schema

from simscen.core.messages.navigation import RecoveryBehavior
from simscen.spec.base import Typed
from simscen.spec.lazy_spec import LazySpec
from simscen.spec.registry import BrokenPlugin, Entry, find, installed, shipped

GROUP_KEY, NAMES_ALLOWED_KEY, MAPPINGS_ALLOWED_KEY = "simscen group", "simscen names", "simscen mappings"
"""Under these keys the metadata of a schema says to which group packages add, and whether names and mappings may stand
there."""


@dataclass(frozen=True)
class ExtensibleUnion:
    """Marks a field that holds a specification of a group; `own` is the type that holds for what is shipped.

    A mapping whose `type` is not shipped is validated by the specification that an installed package adds by that name;
    so is a bare name, where a name is enough (`named`).
    """

    group: str
    own: Any
    named: bool = False

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        inner = handler.generate_schema(self.own)
        told = {GROUP_KEY: self.group, NAMES_ALLOWED_KEY: self.named, MAPPINGS_ALLOWED_KEY: True}
        return core_schema.no_info_wrap_validator_function(self._validate, inner, metadata=told)

    def _validate(self, value: Any, own: core_schema.ValidatorFunctionWrapHandler) -> Any:
        if isinstance(value, Typed) and not type(value).__module__.startswith("simscen."):
            return value
        if self.named and isinstance(value, str) and value not in _names(self.group):
            return specification(_found(self.group, value), {})
        name = value.get("type") if isinstance(value, dict) else None
        if not isinstance(name, str) or name in _names(self.group):
            return own(value)
        entry = find(self.group, name)
        if entry is not None:
            return specification(entry, value)
        details = InitErrorDetails(type=_unknown(self.group, name), loc=("type",), input=name)
        raise ValidationError.from_exception_data("type", [details])


@dataclass(frozen=True)
class TypeName:
    """Marks a text that is the name of a shipped type, as the field says, or of one that an installed package adds."""

    group: str

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        told = {GROUP_KEY: self.group, NAMES_ALLOWED_KEY: True, MAPPINGS_ALLOWED_KEY: False}
        return core_schema.no_info_wrap_validator_function(self._validate, handler(source), metadata=told)

    def _validate(self, value: Any, own: core_schema.ValidatorFunctionWrapHandler) -> Any:
        if isinstance(value, str) and value not in _names(self.group):
            return _found(self.group, value).name
        return own(value)


BehaviorName = Annotated[RecoveryBehavior, TypeName("behavior")]
"""The name of a recovery behavior, as events of the log have it."""


def specification(entry: Entry, value: dict[str, Any]) -> BaseModel:
    """The specification of an installed package with these values, which may lack its `type`."""
    return validate_plugin_spec(entry, {**value, "type": entry.name})


def installed_specs(group: str) -> Iterator[tuple[str, type[BaseModel]]]:
    """The specifications that installed packages add to a group, by name; broken ones are left out."""
    for entry in installed(group):
        if entry.flaw or entry.name in _names(group):
            continue
        try:
            yield entry.name, entry.load()
        except BrokenPlugin:
            continue


def _names(group: str) -> frozenset[str]:
    return frozenset(entry.name for entry in shipped(group))


def _found(group: str, name: str) -> Entry:
    if (entry := find(group, name)) is None:
        raise _unknown(group, name)
    return entry


def _unknown(group: str, name: str) -> PydanticCustomError:
    every = [*(entry.name for entry in shipped(group)), *(entry.name for entry in installed(group))]
    return PydanticCustomError("unknown_type", "no such type", {"value": name, "names": ", ".join(every)})


_ASKED = ("horizon", "clearance_range")
"""What a criterion says of itself, in seconds and meters."""


@dataclass(frozen=True)
class PluginSpec(LazySpec):
    """Marks a type that stands for the specification of a name that an installed package adds."""

    entry: Entry

    def load(self) -> type[BaseModel]:
        """The specification; its package is imported now. Raises BrokenPlugin."""
        return self.entry.load()

    def _validate(self, value: Any) -> BaseModel:
        return validate_plugin_spec(self.entry, value)


def validate_plugin_spec(entry: Entry, value: Any) -> BaseModel:
    """The specification of an entry with these values; whatever its package does wrong is a problem of the file."""
    try:
        return _kept(entry, entry.load().model_validate(value, by_alias=True, by_name=False))
    except BrokenPlugin as broken:
        raise _plugin_error(broken) from broken
    except (ValueError, AssertionError):  # what pydantic takes for a mistake in the file, ValidationError included
        raise
    except Exception as error:  # the boundary to code of others, which can raise anything
        why = f"it breaks down over what is written here: {type(error).__name__}: {error}"
        raise _plugin_error(BrokenPlugin(entry, why)) from error


def _plugin_error(broken: BrokenPlugin) -> PydanticCustomError:
    return PydanticCustomError("plugin", "{problem}", {"problem": str(broken), "hint": broken.hint})


def _kept(entry: Entry, spec: BaseModel) -> BaseModel:
    """The specification. Raises BrokenPlugin where what simscen asks of it before any run is no number."""
    for name in _ASKED:
        number = getattr(spec, name) if hasattr(type(spec), name) else 0.0
        if isinstance(number, bool) or not isinstance(number, int | float) or not (0 <= number < math.inf):
            raise BrokenPlugin(entry, f"its `{name}` is {number!r}, no finite number from 0 on")
    return spec
