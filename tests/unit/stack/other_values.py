"""Values other than the default for the fields of a specification."""

from collections.abc import Iterator
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin


def other_value_groups(kind: Any, default: Any) -> list[list[Any]]:
    """Return groups of values for a field of the type `kind`, which may include invalid values.

    A test of the field passes if one value of each group has an effect. All numbers form one group. If the default is
    None, all other values form one group, because one of them can have the same meaning as None.
    """
    values = list(other_choices(kind, default))
    groups = [values] if values and default is None else [[value] for value in values]
    numbers = other_numbers(kind, default)
    return [*groups, numbers] if numbers else groups


def other_choices(kind: Any, default: Any) -> Iterator[Any]:
    """Yield the Booleans, literals, and lists of one literal that the field can have instead of the default."""
    if get_origin(kind) is Annotated:
        yield from other_choices(get_args(kind)[0], default)
    elif get_origin(kind) in (Union, UnionType):
        for member in get_args(kind):
            if member is not NoneType:
                yield from other_choices(member, default)
    elif get_origin(kind) is Literal:
        yield from (choice for choice in get_args(kind) if choice != default)
    elif get_origin(kind) is list:
        yield from ([item] for item in get_args(get_args(kind)[0]) if isinstance(item, str))
    elif kind is bool:
        yield from ([not default] if default is not None else [False, True])


def other_numbers(kind: Any, default: Any) -> list[float]:
    """Return numbers that the field can have instead of the default."""
    if get_origin(kind) in (Annotated, Union, UnionType):
        return [number for member in get_args(kind) for number in other_numbers(member, default)]
    known = default if isinstance(default, (int, float)) else None
    if kind is int:
        return [known - 2, known - 1, known + 1, 3 * known, 8 * known] if known is not None else [1, 5]
    if kind is float:
        return [0.4 * known, 0.0, 1.8 * known, 30.0 * known] if known else [-0.2, 0.1, 0.3, -1.0, 3.0]
    return []
