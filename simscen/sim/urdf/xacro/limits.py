"""What one expansion may cost, counted and not timed: it ends alike on every machine."""

from typing import Union

MAX_STEPS = 300_000
"""Elements, macros (ten each), characters / 16 and parts of expressions; a TurtleBot 4 needs 10 000."""
MAX_DEPTH = 150
"""Elements, macros, includes, properties and expressions within each other; Python's own stack holds 900."""
MAX_LENGTH = 1 << 16
"""Characters of a text, values in a list."""


class ExpansionError(Exception):
    """Why a text or an expression is not expanded: a sentence without its place, and what helps."""

    def __init__(self, message: str, hint: str = "") -> None:
        self.message, self.hint = message, hint
        super().__init__(message)


class MissingFile(ExpansionError):
    """A file or a package is not there; what else there is can still be looked at."""


class Budget:
    """Counts steps, and, as a context manager, how deep they are within each other. Raises Refused."""

    def __init__(self) -> None:
        self._steps, self._depth = 0, 0

    def spend(self, steps: int = 1) -> None:
        """So many steps more."""
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


# Values of properties: plain data of bounded size.
Value = Union[int, float, str, bool, None, "list[Value]", "dict[str, Value]"]

MAX_BITS = 256
"""Of a whole number: 2**256 is more than any robot needs, and its arithmetic takes no time."""


def check_bounds(value: object) -> Value:
    """`value`, if it is plain data and not large; raises Refused."""
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
            raise ExpansionError(f"a value of type {type(value).__name__} is not used here")


def size(value: Value) -> int:
    """Characters of a text; values in a list, those in its lists too."""
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
    """Convert the text of an attribute: 'quoted' is text, otherwise a number or a boolean if it is one."""
    if len(text) >= 2 and text[0] == text[-1] == "'":
        return text[1:-1]
    if "_" in text:  # Python would read 1_000 as a number
        return text
    for reading in (int, float, parse_bool):
        try:
            return reading(text)
        except (ValueError, ExpansionError):
            continue
    return text


def parse_bool(value: Value) -> bool:
    """Convert the value of `<xacro:if value=…>`; raises Refused."""
    if not isinstance(value, str):
        return bool(value)
    if value in ("true", "True", "false", "False"):
        return value in ("true", "True")
    try:
        return bool(int(value))
    except ValueError:
        raise ExpansionError(f"{value[:60]!r} is neither true nor false") from None
