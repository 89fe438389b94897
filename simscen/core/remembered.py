"""What is worked out from a thing that never changes, once for as long as that thing lives.

Runs of one scenario share its world: the warm process works out what they all need of it, and its forks inherit that.
"""

from collections.abc import Callable
from functools import wraps
from typing import Any, Concatenate, ParamSpec, TypeVar

Thing = TypeVar("Thing")
More = ParamSpec("More")
Result = TypeVar("Result")


def remembered(make: Callable[Concatenate[Thing, More], Result]) -> Callable[Concatenate[Thing, More], Result]:
    """`make`, called once for each thing, and each set of further arguments; the thing itself holds the result.

    Nobody may write into what it gives; if that held the thing in turn, both would stay until garbage is collected.
    """
    name = f"_{make.__module__}.{make.__qualname__}"

    @wraps(make)
    def ask(thing: Thing, /, *more: More.args, **named: More.kwargs) -> Result:
        results: dict[Any, Result] = vars(thing).setdefault(name, {})
        key = more, *sorted(named.items())
        if key not in results:
            results[key] = make(thing, *more, **named)
        return results[key]

    return ask
