"""Specifications that are imported, and whose validators are built, when a file first uses them.

A scenario uses three of sixteen criteria and perhaps one fault. To import and build all of the language was half of
the start of every command.
"""

from dataclasses import dataclass
from importlib import import_module
from types import NoneType
from typing import Any, get_args

from pydantic import BaseModel, GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic.fields import FieldInfo
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, core_schema


@dataclass(frozen=True)
class LazySpec:
    """Marks a type that stands for the specification `name` of `module`."""

    module: str
    name: str

    def load(self) -> type[BaseModel]:
        """The specification; its module is imported now."""
        model: type[BaseModel] = getattr(import_module(self.module), self.name)
        return model

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        schema = core_schema.no_info_plain_validator_function(self._validate)
        return core_schema.nullable_schema(schema) if NoneType in get_args(source) else schema

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        model = self.load()
        model.model_rebuild()
        # Below a nullable the handler makes a reference of a model; of a model itself it would make a copy.
        made = handler(core_schema.nullable_schema(model.__pydantic_core_schema__))
        return made if schema["type"] == "nullable" else made["anyOf"][0]

    def _validate(self, value: Any) -> BaseModel:
        """Pydantic takes the problems of the model for problems of the field, each at its place."""
        return self.load().model_validate(value, by_alias=True, by_name=False)


def annotation_of(field: FieldInfo) -> Any:
    """What a field holds: its annotation, or the specification that is loaded on demand."""
    return next((mark.load() for mark in field.metadata if isinstance(mark, LazySpec)), field.annotation)
