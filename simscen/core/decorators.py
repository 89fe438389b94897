"""Decorators: frozen dataclasses with a fast constructor, and results cached on an instance."""

from collections.abc import Callable
from dataclasses import MISSING, dataclass, fields
from functools import wraps
from typing import Any, Concatenate, ParamSpec, TypeVar

from typing_extensions import dataclass_transform

_Class = TypeVar("_Class")


@dataclass_transform(frozen_default=True)
def fast_dataclass(*, eq: bool = True) -> Callable[[type[_Class]], type[_Class]]:
    """Return a decorator like `dataclass(frozen=True, slots=True)` whose constructor takes half the time.

    The constructor of a frozen dataclass sets each field with `object.__setattr__`, which looks it up by name. The
    constructor generated here sets the slots directly.
    """

    def decorate(plain: type[_Class]) -> type[_Class]:
        slotted = dataclass(frozen=True, slots=True, eq=eq)(plain)
        setattr(slotted, "__init__", _init_function(slotted))  # noqa: B010 - mypy rejects the assignment
        return slotted

    return decorate


def _init_function(slotted: type) -> Any:
    """Return an `__init__` that sets all slots.

    As in `dataclass`, the source that is executed contains only field names, which are valid identifiers.
    """
    namespace: dict[str, Any] = {"MISSING": MISSING}
    arguments, lines = ["self"], ["pass"]
    for field in fields(slotted):
        name, value = field.name, field.name
        namespace[f"set_{name}"] = getattr(slotted, name).__set__
        if field.default_factory is not MISSING:
            namespace[f"default_{name}"] = field.default_factory
            arguments.append(f"{name}=MISSING")
            value = f"default_{name}() if {name} is MISSING else {name}"
        elif field.default is not MISSING:
            namespace[f"default_{name}"] = field.default
            arguments.append(f"{name}=default_{name}")
        else:
            arguments.append(name)
        lines.append(f"set_{name}(self, {value})")
    exec(f"def __init__({', '.join(arguments)}):\n " + "\n ".join(lines), namespace)
    return namespace["__init__"]


Instance = TypeVar("Instance")
Args = ParamSpec("Args")
Result = TypeVar("Result")


def cached_on_instance(
    compute: Callable[Concatenate[Instance, Args], Result],
) -> Callable[Concatenate[Instance, Args], Result]:
    """Return `compute` with its results cached in the `__dict__` of its first argument, the instance.

    The key is formed by the other arguments, which must be hashable. Callers must not modify the result. A result that
    refers to the instance keeps both alive until garbage collection.
    """
    name = f"_{compute.__module__}.{compute.__qualname__}"

    @wraps(compute)
    def cached(instance: Instance, /, *args: Args.args, **kwargs: Args.kwargs) -> Result:
        results: dict[Any, Result] = vars(instance).setdefault(name, {})
        key = args, *sorted(kwargs.items())
        if key not in results:
            results[key] = compute(instance, *args, **kwargs)
        return results[key]

    return cached
