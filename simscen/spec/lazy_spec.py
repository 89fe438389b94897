"""Specifications that are imported, and whose validators are built, when a file first uses them.

A scenario uses few of the types of the language; importing all of them takes half of the start of a command.
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
    """Annotation that stands for the specification class `name` of `module`."""

    module: str
    name: str

    def load(self) -> type[BaseModel]:
        """Import the module and return the specification."""
        model: type[BaseModel] = getattr(import_module(self.module), self.name)
        return model

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        schema = core_schema.no_info_plain_validator_function(self._validate)
        return core_schema.nullable_schema(schema) if NoneType in get_args(source) else schema

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        model = self.load()
        model.model_rebuild()
        # For a nullable schema the handler makes a reference to the model, for a model itself a copy.
        generated = handler(core_schema.nullable_schema(model.__pydantic_core_schema__))
        return generated if schema["type"] == "nullable" else generated["anyOf"][0]

    def _validate(self, value: Any) -> BaseModel:
        """Validate a value; pydantic reports errors of the model as errors of the field, with their positions."""
        return self.load().model_validate(value, by_alias=True, by_name=False)


def annotation_of(field: FieldInfo) -> Any:
    """Return the type of a field: its annotation, or the specification of its LazySpec, which is loaded."""
    return next((mark.load() for mark in field.metadata if isinstance(mark, LazySpec)), field.annotation)
