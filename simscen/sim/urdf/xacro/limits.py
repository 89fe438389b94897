"""Limits and errors of a xacro expansion, and conversion of property values."""

from typing import Union

MAX_STEPS = 300_000
"""Maximum number of steps: one for each element, part of an expression, or 16 characters, and 10 for a macro call."""
MAX_DEPTH = 150
"""Maximum nesting of elements, macros, includes, properties, and expressions."""
MAX_LENGTH = 1 << 16
"""Maximum number of characters in a text, or of values in a list."""
MAX_BITS = 256
"""Maximum number of bits of an integer."""

Value = Union[int, float, str, bool, None, "list[Value]", "dict[str, Value]"]
"""Value of a property or expression."""


class ExpansionError(Exception):
    """Error in a text or expression. `hint` is advice for the user, or ""."""

    def __init__(self, message: str, hint: str = "") -> None:
        self.message, self.hint = message, hint
        super().__init__(message)


class MissingFile(ExpansionError):
    """Error for a file or package that does not exist. The expansion can continue, to find further problems."""


class Budget:
    """Counts steps and nested `with budget` statements; raises ExpansionError above MAX_STEPS or MAX_DEPTH."""

    def __init__(self) -> None:
        self._steps, self._depth = 0, 0

    def spend(self, steps: int = 1) -> None:
        """Count more steps."""
        self._steps += steps
        if self._steps > MAX_STEPS:
            raise ExpansionError(f"expanding takes more than {MAX_STEPS} steps")

    def __enter__(self) -> None:
        self._depth += 1
        if self._depth > MAX_DEPTH:
            self._depth -= 1
            raise ExpansionError(f"macros, properties and elements are nested deeper than {MAX_DEPTH}")

    def __exit__(self, *_: object) -> None:
        self._depth -= 1


def check_bounds(value: object) -> Value:
    """Return `value`; raises ExpansionError if its type is not allowed, or if it exceeds MAX_BITS or MAX_LENGTH."""
    match value:
        case None | bool() | float():
            return value
        case int() if value.bit_length() <= MAX_BITS:
            return value
        case int():
            raise ExpansionError("the number is too large")
        case str() | list() | dict():
            if size(value) > MAX_LENGTH:
                raise ExpansionError(f"the value is longer than {MAX_LENGTH}")
            return value
        case _:
            raise ExpansionError(f"a value of type {type(value).__name__} is not supported")


def size(value: Value) -> int:
    """Return the length of a text, 1 plus the sizes of all values in a list or dictionary, or 1 for other types."""
    match value:
        case str():
            return len(value)
        case list():
            return 1 + sum(size(each) for each in value)
        case dict():
            return 1 + sum(size(each) for each in value.values())
        case _:
            return 1


def parse_literal(text: str) -> Value:
    """Return a text as a number or boolean if possible, else as text without enclosing single quotes."""
    if len(text) >= 2 and text[0] == text[-1] == "'":
        return text[1:-1]
    if "_" in text:  # Python would read 1_000 as a number
        return text
    for convert in (int, float, parse_bool):
        try:
            return convert(text)
        except (ValueError, ExpansionError):
            continue
    return text


def parse_bool(value: Value) -> bool:
    """Return a value as a boolean, as in `<xacro:if value=…>`; raises ExpansionError for any other text."""
    if not isinstance(value, str):
        return bool(value)
    if value in ("true", "True", "false", "False"):
        return value in ("true", "True")
    try:
        return bool(int(value))
    except ValueError:
        raise ExpansionError(f"{value[:60]!r} is neither true nor false") from None
