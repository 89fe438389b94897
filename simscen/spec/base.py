"""The base of everything a user writes in YAML."""

import ast
import inspect
import re
import sys
from collections.abc import Callable
from functools import cache
from importlib import import_module
from typing import Annotated, Any, ClassVar, Generic, Literal, TypeVar

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    GetJsonSchemaHandler,
    RootModel,
    model_validator,
)
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, PydanticCustomError


class Spec(BaseModel):
    """Strict, frozen, finite, and closed: an unknown key is an error."""

    model_config = ConfigDict(
        strict=True,
        extra="forbid",
        frozen=True,
        allow_inf_nan=False,
        populate_by_name=True,
        defer_build=True,  # a light command validates nothing; building every schema costs it 50 ms
    )

    @classmethod
    def __get_pydantic_json_schema__(cls, core: CoreSchema, handler: GetJsonSchemaHandler) -> JsonSchemaValue:
        """The schema with the docstring of each field as its description."""
        schema = handler.resolve_ref_schema(handler(core))
        docs = field_docs(cls)
        for name, field in cls.model_fields.items():
            if name in docs:
                schema["properties"][field.alias or name]["description"] = docs[name]
        return schema


def _no_boolean(value: Any) -> Any:
    if isinstance(value, bool):  # `True == 1`, so that a Literal would take it
        raise PydanticCustomError("literal_error", "expected 1", {"expected": "1"})
    return value


LanguageVersion = Annotated[Literal[1], BeforeValidator(_no_boolean)]
"""The version of the language that a file is written for."""

T = TypeVar("T")


class Value(RootModel[T], Generic[T]):
    """A bare value instead of a mapping, e.g. `time: 10 s`, as strict as a mapping is."""

    model_config = ConfigDict(strict=True, frozen=True, allow_inf_nan=False, defer_build=True)


class Ranged(Spec):
    """A specification in which no `min_…` is greater than its `max_…`."""

    @model_validator(mode="after")
    def _in_order(self) -> "Ranged":
        for low in type(self).model_fields:
            high = low.replace("min", "max")
            if high == low or high not in type(self).model_fields:
                continue
            least, most = getattr(self, low), getattr(self, high)
            if least > most:
                raise ValueError(f"`{low}` {least:g} is greater than `{high}` {most:g}")
        return self


def by_default() -> Any:
    """The default of a field that holds a mapping: `{}`, validated when it is needed.

    An instance as the default would have its own validator built at import, for every command: 10 ms in all.
    """
    return Field(default_factory=dict, validate_default=True)


def type_discriminator(default: str) -> Callable[[Any], str | None]:
    """Tells the members of a union apart by their `type`, which may be left out for the default one."""

    def tag(value: Any) -> str | None:
        if isinstance(value, dict):
            return str(value.get("type", default))
        return getattr(value, "type", None)

    return tag


def field_docs(model: type) -> dict[str, str]:
    """Field name → docstring, those of base classes included."""
    docs: dict[str, str] = {}
    for base in reversed(model.__mro__):
        if base.__module__.partition(".")[0] not in ("builtins", "pydantic", "abc", "typing"):
            docs.update(_of_module(base.__module__).get(base.__name__, {}))
    return docs


@cache
def _of_module(module: str) -> dict[str, dict[str, str]]:
    try:
        tree = ast.parse(inspect.getsource(sys.modules[module]))
    except OSError:  # a package that was installed without its source
        return {}
    return {node.name: _of_class(node) for node in tree.body if isinstance(node, ast.ClassDef)}


def _of_class(node: ast.ClassDef) -> dict[str, str]:
    docs = {}
    for statement, following in zip(node.body, node.body[1:], strict=False):
        if isinstance(statement, ast.AnnAssign) and isinstance(statement.target, ast.Name):
            match following:
                case ast.Expr(value=ast.Constant(value=str(text))):
                    docs[statement.target.id] = inspect.cleandoc(text)
    return docs


# MERGED: Specifications of what is built when a run is assembled: parts of a stack, whole stacks, sensors.
class Component(Spec):
    """What a file says of a component; its class is imported when a run is assembled, and no sooner.

    So a file is validated without the engine or the library that the component needs.
    """

    component: ClassVar[str]
    """`package.module:Class`, called as `Class(specification, setting)`."""

    @classmethod
    def broken_promise(cls) -> str:
        """Why it is no specification of a component; "" for one that is."""
        named = isinstance(getattr(cls, "component", None), str) and re.fullmatch(r"[\w.]+:\w+", cls.component)
        return "" if named else "it does not say what its `component` is, as package.module:Class"

    @classmethod
    def implementation(cls) -> Any:
        """The class that `component` names. Raises ImportError or AttributeError where there is none."""
        module, _, name = cls.component.partition(":")
        return getattr(import_module(module), name)


class Typed(Component):
    """A component that a file chooses by its `type`: the name of its entry point."""

    type: str = ""
    """Which one it is."""
