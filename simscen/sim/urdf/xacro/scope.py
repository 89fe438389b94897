"""Nested scopes of properties."""

from dataclasses import dataclass, field
from typing import Union

from simscen.sim.urdf.xacro.limits import Value
from simscen.sim.urdf.xml_source import Element


@dataclass(frozen=True, eq=False)
class Lazy:
    """Text of a property that is evaluated on first use."""

    text: str


@dataclass(frozen=True, eq=False)
class Block:
    """Elements to insert: the children of `element`, or with `whole` the element itself."""

    element: Element
    whole: bool


@dataclass(eq=False)
class Resolving:
    """Marks a property that is being evaluated; using it again is a circular definition."""


ScopeValue = Union[Value, Lazy, Block, Resolving, "Scope"]


@dataclass(eq=False)
class Scope:
    """Properties of a file, of an included namespace, or of one call of a macro."""

    parent: "Scope | None" = None
    namespace: bool = False
    values: dict[str, ScopeValue] = field(default_factory=dict)

    def owner(self, name: str) -> "Scope | None":
        """Return the innermost scope with a property of this name."""
        scope: Scope | None = self
        while scope is not None and name not in scope.values:
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
        """Remove a property from this scope and all enclosing ones."""
        scope: Scope | None = self
        while scope is not None:
            scope.values.pop(name, None)
            scope = scope.parent
