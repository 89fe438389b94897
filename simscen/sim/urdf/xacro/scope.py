"""Properties and macros by name, each scope in front of the one around it."""

from dataclasses import dataclass, field
from typing import Union

from simscen.sim.urdf.xacro.limits import Value
from simscen.sim.urdf.xml_source import Element


@dataclass(frozen=True, eq=False)
class Lazy:
    """A property's text, evaluated where it is first used."""

    text: str


@dataclass(frozen=True, eq=False)
class Block:
    """Elements to insert; `whole` = with the element that holds them."""

    element: Element
    whole: bool


@dataclass(eq=False)
class Resolving:
    """A property that is being evaluated: to meet it again is a circle."""


Held = Union[Value, Lazy, Block, Resolving, "Scope"]


@dataclass(eq=False)
class Scope:
    """The properties of the file, of an included namespace or of one call of a macro."""

    parent: "Scope | None" = None
    namespace: bool = False
    held: dict[str, Held] = field(default_factory=dict)

    def owner(self, name: str) -> "Scope | None":
        """Return the innermost scope with a property of this name."""
        scope: Scope | None = self
        while scope is not None and name not in scope.held:
            scope = scope.parent
        return scope

    def top(self) -> "Scope":
        """Return the outermost scope."""
        scope = self
        while scope.parent is not None:
            scope = scope.parent
        return scope

    def caller(self) -> "Scope":
        """Return the scope for `scope="parent"`: the enclosing one; in a macro, beyond namespaces."""
        scope = self.parent
        while scope is not None and scope.namespace and not self.namespace:
            scope = scope.parent
        return scope or self.top()

    def remove(self, name: str) -> None:
        """Forget a property in this scope and all around it."""
        scope: Scope | None = self
        while scope is not None:
            scope.held.pop(name, None)
            scope = scope.parent
