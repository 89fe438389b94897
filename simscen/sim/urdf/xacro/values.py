"""What a property can be: plain data of bounded size."""

from typing import Union

from simscen.sim.urdf.xacro.budget import LONGEST, Refused

Value = Union[int, float, str, bool, None, "list[Value]", "dict[str, Value]"]

MOST_BITS = 256
"""Of a whole number: 2**256 is more than any robot needs, and its arithmetic takes no time."""


def bounded(value: object) -> Value:
    """`value`, if it is plain data and not large; raises Refused."""
    match value:
        case None | bool() | float():
            return value
        case int() if value.bit_length() <= MOST_BITS:
            return value
        case int():
            raise Refused("the number is too large")
        case str() | list() | dict():
            if size(value) > LONGEST:
                raise Refused(f"the value is longer than {LONGEST}")
            return value
        case _:
            raise Refused(f"a value of type {type(value).__name__} is not used here")


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


def literal(text: str) -> Value:
    """What a text in an attribute means by itself: 'quoted' is text, then a number or a boolean if it is one."""
    if len(text) >= 2 and text[0] == text[-1] == "'":
        return text[1:-1]
    if "_" in text:  # Python would read 1_000 as a number
        return text
    for reading in (int, float, truth):
        try:
            return reading(text)
        except (ValueError, Refused):
            continue
    return text


def truth(value: Value) -> bool:
    """What `<xacro:if value=…>` means; raises Refused."""
    if not isinstance(value, str):
        return bool(value)
    if value in ("true", "True", "false", "False"):
        return value in ("true", "True")
    try:
        return bool(int(value))
    except ValueError:
        raise Refused(f"{value[:60]!r} is neither true nor false") from None
