"""Lazy imports: modules that are loaded when one of their attributes is first used.

importlib.util.LazyLoader is no alternative: up to Python 3.11, a second `import numpy` already loads the module.
"""

import importlib.util
import sys
from types import ModuleType
from typing import Any


class _LazyModule(ModuleType):
    """Placeholder of a module that is replaced by the real one on the first attribute access."""

    def __getattr__(self, name: str) -> Any:
        if name.startswith("__") and name != "__path__":  # requested by the import system; __path__ for submodules
            raise AttributeError(name)
        if sys.modules.get(self.__name__) is self:
            del sys.modules[self.__name__]
        real = importlib.import_module(self.__name__)
        self.__dict__.update(vars(real))
        self.__class__ = ModuleType  # type: ignore[assignment]
        return getattr(real, name)


def import_lazily(name: str, *functions: str) -> None:
    """Make `import name` free until an attribute of the module is used.

    `from name import function` counts as use, except for the given `functions`, which load the module when called.
    """
    if name in sys.modules:
        return
    module = _LazyModule(name)
    if functions:
        spec = importlib.util.find_spec(name)
        module.__path__ = (spec and spec.submodule_search_locations) or []  # `from name import` needs it
    for function in functions:
        setattr(module, function, _lazy_function(name, function))
    sys.modules[name] = module
    parent, _, child = name.rpartition(".")
    if parent:
        setattr(sys.modules[parent], child, module)


def _lazy_function(module: str, function: str) -> Any:
    def call(*arguments: Any, **keywords: Any) -> Any:
        if isinstance(sys.modules[module], _LazyModule):
            del sys.modules[module]
        return getattr(importlib.import_module(module), function)(*arguments, **keywords)

    return call
