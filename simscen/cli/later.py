"""Import a library when it is first used, for commands that may end without using it.

importlib.util.LazyLoader does not serve: on Python 3.11 and before, a second `import numpy` already loads it.
"""

import importlib
import sys
from types import ModuleType
from typing import Any


class _Later(ModuleType):
    """Stands for a module until the first look at one of its attributes."""

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__") and name != "__path__":  # the import system asks; __path__ only for a submodule
            raise AttributeError(name)
        if sys.modules.get(self.__name__) is self:
            del sys.modules[self.__name__]
        real = importlib.import_module(self.__name__)
        self.__dict__.update(vars(real))
        self.__class__ = ModuleType  # type: ignore[assignment]
        return getattr(real, name)


def import_later(name: str) -> None:
    """Let `import name` cost nothing from now on, until something of it is used."""
    if name not in sys.modules:
        sys.modules[name] = _Later(name)
