"""Other values that a field of a specification might have."""

from collections.abc import Iterator
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin


def others(kind: Any, default: Any) -> list[list[Any]]:
    """The other values that a field of this type might have, in groups of which one must count; not all need be valid.

    Of numbers any may count. So may any where the default is None: what that stands for is one of the values.
    """
    each = list(alternatives(kind, default))
    groups = [each] if each and default is None else [[value] for value in each]
    return [*groups, *([found] if (found := numbers(kind, default)) else [])]


def alternatives(kind: Any, default: Any) -> Iterator[Any]:
    """The other values that a field of this type might have, but for numbers."""
    if get_origin(kind) is Annotated:
        yield from alternatives(get_args(kind)[0], default)
    elif get_origin(kind) in (Union, UnionType):
        for member in get_args(kind):
            if member is not NoneType:
                yield from alternatives(member, default)
    elif get_origin(kind) is Literal:
        yield from (each for each in get_args(kind) if each != default)
    elif get_origin(kind) is list:
        yield from ([each] for each in get_args(get_args(kind)[0]) if isinstance(each, str))
    elif kind is bool:
        yield from ([not default] if default is not None else [False, True])


def numbers(kind: Any, default: Any) -> list[float]:
    """Other numbers that a field of this type might have."""
    if get_origin(kind) in (Annotated, Union, UnionType):
        return [each for member in get_args(kind) for each in numbers(member, default)]
    known = default if isinstance(default, (int, float)) else None
    if kind is int:
        return [known - 2, known - 1, known + 1, 3 * known, 8 * known] if known is not None else [1, 5]
    if kind is float:
        return [0.4 * known, 0.0, 1.8 * known, 30.0 * known] if known else [-0.2, 0.1, 0.3, -1.0, 3.0]
    return []
