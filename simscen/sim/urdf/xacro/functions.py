"""Functions, constants, and methods that xacro expressions can use. The size of their results is limited."""

import math
from collections.abc import Callable, Mapping
from typing import Any

from simscen.sim.urdf.xacro.limits import MAX_LENGTH, ExpansionError

Function = Callable[..., object]

PYTHON_TYPES: Mapping[str, type] = {"int": int, "float": float, "str": str, "bool": bool, "list": list, "dict": dict}
"""Types by name, for conversions such as `int(…)` and for `isinstance`."""


def _limited_round(number: float, digits: int | None = None) -> float:
    if digits is not None and abs(digits) > 100:  # Python would compute 10**digits
        raise ExpansionError("round() takes up to 100 digits")
    return round(number, digits)


def _limited_range(*bounds: int) -> list[int]:
    numbers = range(*bounds)
    if len(numbers) > MAX_LENGTH:
        raise ExpansionError(f"range() gives more than {MAX_LENGTH} numbers")
    return list(numbers)


def _tokenize(text: object, separators: str = ",; ", skip_empty: bool = True) -> list[str]:
    """Split a text at each of the separators, as `xacro.tokenize` does."""
    if not isinstance(text, str):
        raise ExpansionError("tokenize() takes a text")
    for separator in separators[1:]:
        text = text.replace(separator, separators[0])
    return [word for word in text.split(separators[0]) if word or not skip_empty]


def _fail_with_message(*messages: object) -> str:
    raise ExpansionError(f"error in the file: {' '.join(map(str, messages))[:200]}")


MATH_FUNCTIONS: Mapping[str, Function | float] = {
    name: getattr(math, name)
    for name in (
        "acos", "acosh", "asin", "asinh", "atan", "atan2", "atanh", "ceil", "copysign", "cos", "cosh", "degrees", "exp",
        "expm1", "fabs", "floor", "fmod", "hypot", "isfinite", "isinf", "isnan", "log", "log10", "log1p", "log2", "pow",
        "radians", "sin", "sinh", "sqrt", "tan", "tanh", "trunc", "pi", "e", "tau", "inf", "nan",
    )
}  # fmt: skip
PYTHON_FUNCTIONS: Mapping[str, Function] = {
    **PYTHON_TYPES, "abs": abs, "all": all, "any": any, "len": len, "max": max, "min": min, "range": _limited_range,
    "round": _limited_round, "sorted": sorted, "sum": sum,
}  # fmt: skip
XACRO_FUNCTIONS: Mapping[str, Function] = {
    # A message or warning is meant for the authors of the file and is not shown.
    "message": lambda *_: "", "warning": lambda *_: "", "error": _fail_with_message, "fatal": _fail_with_message,
    "tokenize": _tokenize,
}  # fmt: skip
NAMESPACES: Mapping[str, Mapping[str, Function | float]] = {
    "math": MATH_FUNCTIONS,
    "python": PYTHON_FUNCTIONS,
    "xacro": XACRO_FUNCTIONS,
}
"""Functions and constants that can be used as `namespace.name`."""
GLOBAL_FUNCTIONS: Mapping[str, Function | float] = {**MATH_FUNCTIONS, **PYTHON_FUNCTIONS}
"""Functions and constants that can be used without a namespace."""


def _limited_replace(text: str, old: str, new: str) -> str:
    if text.count(old) * len(new) > MAX_LENGTH:
        raise ExpansionError(f"replace() gives more than {MAX_LENGTH} characters")
    return text.replace(old, new)


def _limited_join(separator: str, words: list[Any]) -> str:
    if len(words) * len(separator) > MAX_LENGTH:
        raise ExpansionError(f"join() gives more than {MAX_LENGTH} characters")
    return separator.join(words)


METHODS: Mapping[tuple[type, str], Function] = {
    **{(str, name): getattr(str, name) for name in (
        "count", "endswith", "find", "lower", "lstrip", "rstrip", "split", "startswith", "strip", "upper",
    )},
    (str, "replace"): _limited_replace,
    (str, "join"): _limited_join,
    **{(list, name): getattr(list, name) for name in ("count", "index", "pop")},
    (dict, "get"): dict.get,
    (dict, "keys"): list,
    (dict, "values"): lambda mapping: list(mapping.values()),
}  # fmt: skip
"""Methods of texts, lists, and dictionaries that can be called, by type and name."""
