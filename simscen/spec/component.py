"""Specifications of what is built when a run is assembled: parts of a stack, whole stacks, sensors."""

import re
from importlib import import_module
from typing import Any, ClassVar

from simscen.spec.base import Spec


class Component(Spec):
    """What a file says of a component; its class is imported when a run is assembled, and no sooner.

    So a file is validated without the engine or the library that the component needs.
    """

    component: ClassVar[str]
    """`package.module:Class`, called as `Class(specification, setting)`."""

    @classmethod
    def broken_promise(cls) -> str:
        """Why it is no specification of a component; "" for one that is."""
        named = isinstance(getattr(cls, "component", None), str) and re.fullmatch(r"[\w.]+:\w+", cls.component)
        return "" if named else "it does not say what its `component` is, as package.module:Class"

    @classmethod
    def implementation(cls) -> Any:
        """The class that `component` names. Raises ImportError or AttributeError where there is none."""
        module, _, name = cls.component.partition(":")
        return getattr(import_module(module), name)


class Typed(Component):
    """A component that a file chooses by its `type`: the name of its entry point."""

    type: str = ""
    """Which one it is."""
