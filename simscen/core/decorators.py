"""Decorators for frozen dataclasses with a fast constructor, and for caching results in an instance."""

from collections.abc import Callable
from dataclasses import MISSING, dataclass, fields
from functools import wraps
from typing import Any, Concatenate, ParamSpec, TypeVar

from typing_extensions import dataclass_transform

_Class = TypeVar("_Class")


@dataclass_transform(frozen_default=True)
def fast_dataclass(*, eq: bool = True) -> Callable[[type[_Class]], type[_Class]]:
    """Return a decorator like `dataclass(frozen=True, slots=True, eq=eq)`, but with a constructor twice as fast."""

    def decorate(cls: type[_Class]) -> type[_Class]:
        slots_class = dataclass(frozen=True, slots=True, eq=eq)(cls)
        setattr(slots_class, "__init__", _init_function(slots_class))  # noqa: B010 - mypy rejects the assignment
        return slots_class

    return decorate


def _init_function(slots_class: type) -> Any:
    """Return a generated `__init__` that sets the slots directly, without the name lookup of `object.__setattr__`."""
    namespace: dict[str, Any] = {"MISSING": MISSING}
    arguments, lines = ["self"], ["pass"]
    for field in fields(slots_class):
        name, value = field.name, field.name
        namespace[f"set_{name}"] = getattr(slots_class, name).__set__
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
    # As in `dataclass`, the source contains only field names, which are valid identifiers.
    exec(f"def __init__({', '.join(arguments)}):\n " + "\n ".join(lines), namespace)
    return namespace["__init__"]


Instance = TypeVar("Instance")
Args = ParamSpec("Args")
Result = TypeVar("Result")


def cached_on_instance(
    compute: Callable[Concatenate[Instance, Args], Result],
) -> Callable[Concatenate[Instance, Args], Result]:
    """Cache the results of a method or function in the `__dict__` of its first argument, the instance.

    The other arguments are the key of the cache and must be hashable. Callers must not modify the results.
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
