"""Base classes of specifications: pydantic models of parts of YAML files."""

import ast
import inspect
import re
import sys
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from types import NoneType
from typing import Annotated, Any, ClassVar, Generic, Literal, TypeVar, get_args

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    RootModel,
    model_validator,
)
from pydantic.fields import FieldInfo
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, PydanticCustomError, core_schema


class Spec(BaseModel):
    """Base class of all specifications: immutable and strict. Unknown keys, infinity, and NaN are errors."""

    model_config = ConfigDict(
        strict=True,
        extra="forbid",
        frozen=True,
        allow_inf_nan=False,
        populate_by_name=True,
        defer_build=True,  # building all validators takes 50 ms, and light commands need none of them
    )

    @classmethod
    def __get_pydantic_json_schema__(cls, core: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        """Return the schema with the docstring of each field as its description."""
        schema = handler.resolve_ref_schema(handler(core))
        docs = field_docs(cls)
        for name, field in cls.model_fields.items():
            if name in docs:
                schema["properties"][field.alias or name]["description"] = docs[name]
        return schema


def _reject_boolean(value: Any) -> Any:
    if isinstance(value, bool):  # `True == 1`, so a Literal accepts it
        raise PydanticCustomError("literal_error", "expected 1", {"expected": "1"})
    return value


LanguageVersion = Annotated[Literal[1], BeforeValidator(_reject_boolean)]
"""Version of the scenario language in which a file is written. 1 is the only version."""

T = TypeVar("T")


class Value(RootModel[T], Generic[T]):
    """Base class of specifications of a single value instead of a mapping, e.g. `10 s` in `time: 10 s`."""

    model_config = ConfigDict(strict=True, frozen=True, allow_inf_nan=False, defer_build=True)


class Ranged(Spec):
    """Base class of specifications with pairs of minimum and maximum, such as `laser_min_range` and `laser_max_range`.

    Fields form a pair if their names differ only in `min` and `max`. No minimum may exceed its maximum.
    """

    unlimited_at_zero: ClassVar[tuple[str, ...]] = ()
    """Names of the maximum fields in which 0 or less means "no limit"."""

    def range_problem(self) -> str:
        """Return a message about the first minimum that exceeds its maximum; "" if there is none."""
        for low in type(self).model_fields:
            high = low.replace("min", "max")
            if high == low or high not in type(self).model_fields:
                continue
            minimum, maximum = getattr(self, low), getattr(self, high)
            if minimum > maximum and not (high in self.unlimited_at_zero and maximum <= 0):
                return f"`{low}` {minimum:g} is greater than `{high}` {maximum:g}"
        return ""

    @model_validator(mode="after")
    def _check_ranges(self) -> "Ranged":
        if problem := self.range_problem():
            raise ValueError(problem)
        return self


def text_or_mapping(value: Any) -> str:
    """Return the tag of a value in a union of a text and a mapping: "a text" or "a mapping"."""
    return "a text" if isinstance(value, str) else "a mapping"


def one_or_several(value: Any) -> str:
    """Return the tag of a value in a union of a value and a list of such values: "one value" or "several values"."""
    return "several values" if isinstance(value, list) else "one value"


def by_default() -> Any:
    """Return an optional pydantic field. Its default is the specification with default values."""
    # Creating the specification at import would cost every command 10 ms.
    return Field(default_factory=dict, validate_default=True)


def field_docs(model: type) -> dict[str, str]:
    """Return the docstrings of all fields of a model by field name, including inherited fields."""
    docs: dict[str, str] = {}
    for base in reversed(model.__mro__):
        if base.__module__.partition(".")[0] not in ("builtins", "pydantic", "abc", "typing"):
            docs.update(_docs_of_module(base.__module__).get(base.__name__, {}))
    return docs


@cache
def _docs_of_module(module: str) -> dict[str, dict[str, str]]:
    """Return field docstrings by class name and field name; {} if the source of the module is not installed."""
    try:
        tree = ast.parse(inspect.getsource(sys.modules[module]))
    except OSError:
        return {}
    return {node.name: _docs_of_class(node) for node in tree.body if isinstance(node, ast.ClassDef)}


def _docs_of_class(node: ast.ClassDef) -> dict[str, str]:
    docs = {}
    for statement, following in zip(node.body, node.body[1:], strict=False):
        if isinstance(statement, ast.AnnAssign) and isinstance(statement.target, ast.Name):
            match following:
                case ast.Expr(value=ast.Constant(value=str(text))):
                    docs[statement.target.id] = inspect.cleandoc(text)
    return docs


class Component(Spec):
    """Specification of an object that is built for a run: a stack, a part of a stack, or a sensor.

    The class of the object is imported when the run starts, so that validation does not import the libraries of the
    class.
    """

    component: ClassVar[str]
    """Address `package.module:Class` of the class of the object, or of a function that returns the object.

    The class or function is called with the specification and a setting (facts about the run). The setting is a
    simscen.stack.setting.Setting for a stack and its parts, and a simscen.sensors.sensor.SensorSetting for a sensor.
    """

    @classmethod
    def definition_problem(cls) -> str:
        """Return the reason why `component` of this class is missing or malformed; "" if it is valid."""
        is_valid = isinstance(getattr(cls, "component", None), str) and re.fullmatch(r"[\w.]+:\w+", cls.component)
        return "" if is_valid else "it has no attribute `component` of the form package.module:Class"

    @classmethod
    def implementation(cls) -> Any:
        """Import and return the class or function that `component` names. Raises ImportError or AttributeError."""
        module, _, name = cls.component.partition(":")
        return getattr(import_module(module), name)


class Typed(Component):
    """Component that is selected by its name under the key `type`."""

    type: str = ""
    """Name of the component."""


@dataclass(frozen=True)
class LazySpec:
    """Annotation of a field: the specification class `name` in `module`.

    The module is imported when a value of the field is validated.
    """

    module: str
    name: str

    def load(self) -> type[BaseModel]:
        """Import the module and return the specification class."""
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
        return self.load().model_validate(value, by_alias=True, by_name=False)


def annotation_of(field: FieldInfo) -> Any:
    """Return the type of a field. For a LazySpec field, this is the specification class, which is imported."""
    return next((item.load() for item in field.metadata if isinstance(item, LazySpec)), field.annotation)
