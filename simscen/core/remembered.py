"""What is worked out from a thing that never changes, once for as long as that thing lives.

Runs of one scenario share its world: the warm process works out what they all need of it, and its forks inherit that.
"""

from collections.abc import Callable, Hashable
from functools import wraps
from typing import Any, Concatenate, ParamSpec, TypeVar
from weakref import WeakKeyDictionary

Thing = TypeVar("Thing", bound=Hashable)
More = ParamSpec("More")
Result = TypeVar("Result")


def remembered(make: Callable[Concatenate[Thing, More], Result]) -> Callable[Concatenate[Thing, More], Result]:
    """`make`, called once for each thing, which is known by identity, and each set of further arguments.

    Nobody may write into what it gives; and that must not hold the thing itself, for then neither would ever go.
    """
    known: WeakKeyDictionary[Thing, dict[Any, Result]] = WeakKeyDictionary()

    @wraps(make)
    def ask(thing: Thing, /, *more: More.args, **named: More.kwargs) -> Result:
        results = known.setdefault(thing, {})
        key = more, *sorted(named.items())
        if key not in results:
            results[key] = make(thing, *more, **named)
        return results[key]

    return ask
