"""Import a library when it is first used, for commands that may end without using it.

importlib.util.LazyLoader does not serve: on Python 3.11 and before, a second `import numpy` already loads it.
"""

import importlib.util
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


def import_lazily(name: str, *functions: str) -> None:
    """Let `import name` cost nothing from now on, until something of it is used.

    `from name import function` counts as use, except for `functions`: those only when they are called.
    """
    if name in sys.modules:
        return
    module = _Later(name)
    if functions:
        spec = importlib.util.find_spec(name)
        module.__path__ = (spec and spec.submodule_search_locations) or []  # `from name import` looks at it
    for function in functions:
        setattr(module, function, _called_later(name, function))
    sys.modules[name] = module
    parent, _, child = name.rpartition(".")
    if parent:
        setattr(sys.modules[parent], child, module)


def _called_later(module: str, function: str) -> Any:
    def call(*arguments: Any, **named: Any) -> Any:
        if isinstance(sys.modules[module], _Later):
            del sys.modules[module]
        return getattr(importlib.import_module(module), function)(*arguments, **named)

    return call
