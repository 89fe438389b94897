"""Specifications of installed packages: imported when a file uses them, and a problem of that file where broken."""

import math
from dataclasses import dataclass
from typing import Any

from pydantic import BaseModel
from pydantic_core import PydanticCustomError

from simscen.spec.ondemand import OnDemand
from simscen.spec.registry import BrokenPlugin, Entry

_ASKED = ("horizon", "clearance_range")
"""What a criterion says of itself, in seconds and metres."""


@dataclass(frozen=True)
class OfPackage(OnDemand):
    """Marks a type that stands for the specification of a name that an installed package adds."""

    entry: Entry

    def load(self) -> type[BaseModel]:
        """The specification; its package is imported now. Raises BrokenPlugin."""
        return self.entry.load()

    def _validate(self, value: Any) -> BaseModel:
        return validated(self.entry, value)


def validated(entry: Entry, value: Any) -> BaseModel:
    """The specification of an entry with these values; whatever its package does wrong is a problem of the file."""
    try:
        return _kept(entry, entry.load().model_validate(value, by_alias=True, by_name=False))
    except BrokenPlugin as broken:
        raise _problem(broken) from broken
    except (ValueError, AssertionError):  # what pydantic takes for a mistake in the file, ValidationError included
        raise
    except Exception as error:  # the boundary to code of others, which can raise anything
        why = f"it breaks down over what is written here: {type(error).__name__}: {error}"
        raise _problem(BrokenPlugin(entry, why)) from error


def _problem(broken: BrokenPlugin) -> PydanticCustomError:
    return PydanticCustomError("plugin", "{problem}", {"problem": str(broken), "hint": broken.hint})


def _kept(entry: Entry, spec: BaseModel) -> BaseModel:
    """The specification. Raises BrokenPlugin where what simscen asks of it before any run is no number."""
    for name in _ASKED:
        number = getattr(spec, name) if hasattr(type(spec), name) else 0.0
        if isinstance(number, bool) or not isinstance(number, int | float) or not (0 <= number < math.inf):
            raise BrokenPlugin(entry, f"its `{name}` is {number!r}, no finite number from 0 on")
    return spec
