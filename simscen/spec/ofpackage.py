"""Specifications of installed packages: imported when a file uses them, and a problem of that file where broken."""

from dataclasses import dataclass
from typing import Any

from pydantic import BaseModel
from pydantic_core import PydanticCustomError

from simscen.spec.ondemand import OnDemand
from simscen.spec.registry import BrokenPlugin, Entry


@dataclass(frozen=True)
class OfPackage(OnDemand):
    """Marks a type that stands for the specification of a name that an installed package adds."""

    entry: Entry

    def load(self) -> type[BaseModel]:
        """The specification; its package is imported now. Raises BrokenPlugin."""
        return self.entry.load()

    def _validate(self, value: Any) -> BaseModel:
        try:
            self.load()
        except BrokenPlugin as broken:
            told = {"problem": str(broken), "hint": broken.hint}
            raise PydanticCustomError("plugin", "{problem}", told) from broken
        return super()._validate(value)
