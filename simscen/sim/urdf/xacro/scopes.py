"""Scopes of xacro files: the properties, blocks, and macros that are visible at a place."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Union

from simscen.sim.urdf.xacro.limits import Value
from simscen.sim.urdf.xml_source import Element


@dataclass(frozen=True)
class Parameter:
    """A parameter of a macro.

    If a call has no argument for the parameter, the value is `default` (None: the argument is required). If the
    parameter `is_forwarded` (`^`), a property of the same name in the caller's scope takes precedence over `default`.
    """

    name: str
    is_forwarded: bool = False
    default: str | None = None

    @property
    def is_block(self) -> bool:
        """Whether the argument is a block: a child element of the call. The name then begins with `*` or `**`."""
        return self.name.startswith("*")


@dataclass(frozen=True, eq=False)
class Macro:
    """A macro. `body` is the `<xacro:macro>` element."""

    name: str
    parameters: tuple[Parameter, ...]
    body: Element


@dataclass(frozen=True, eq=False)
class LazyText:
    """Text of a property that is evaluated when the property is first used."""

    text: str


@dataclass(frozen=True, eq=False)
class Block:
    """Block that `<xacro:insert_block>` inserts: `element` if `includes_element`, else only its children."""

    element: Element
    includes_element: bool


@dataclass(eq=False)
class EvaluationMarker:
    """Marker for a property that is being evaluated, to detect circular definitions."""


ScopeValue = Union[Value, LazyText, Block, EvaluationMarker, "Scope"]
"""Content of a name in a scope: a property, a block, or the scope of an included namespace."""


@dataclass(eq=False)
class Scope:
    """Definitions in a file, in an included namespace, or in one macro call.

    The `values` are properties, blocks (whose names begin with `*` or `**`), and the scopes of included namespaces. The
    definitions of the `parent` scope are visible as well, but its macros and namespaces are not visible in a namespace.
    """

    parent: "Scope | None" = None
    is_namespace: bool = False
    values: dict[str, ScopeValue] = field(default_factory=dict)
    macros: dict[str, Macro] = field(default_factory=dict)

    def _outwards(self) -> "Iterator[Scope]":
        """Yield this scope, its parent, the parent's parent, and so on."""
        scope: Scope | None = self
        while scope is not None:
            yield scope
            scope = scope.parent

    def find_scope(self, name: str) -> "Scope | None":
        """Return the innermost visible scope with a value of this name, or None."""
        return next((scope for scope in self._outwards() if name in scope.values), None)

    def find_macro(self, name: str) -> Macro | None:
        """Return the innermost visible macro with this name, or None."""
        for scope in self._outwards():
            if name in scope.macros or scope.is_namespace:
                return scope.macros.get(name)
        return None

    def find_namespace(self, name: str) -> "Scope | None":
        """Return the scope of the innermost visible namespace with this name, or None."""
        for scope in self._outwards():
            if name in scope.values or scope.is_namespace:
                found = scope.values.get(name)
                return found if isinstance(found, Scope) else None
        return None

    def top(self) -> "Scope":
        """Return the outermost scope."""
        *_, outermost = self._outwards()
        return outermost

    def caller(self) -> "Scope":
        """Return the scope in which `<xacro:property scope="parent">` sets a property.

        In a namespace, this is the parent scope. In a macro call, this is the innermost enclosing scope that is not a
        namespace.
        """
        scope = self.parent
        while scope is not None and scope.is_namespace and not self.is_namespace:
            scope = scope.parent
        return scope or self.top()

    def remove(self, name: str) -> None:
        """Remove a property from this scope and all enclosing scopes."""
        for scope in self._outwards():
            scope.values.pop(name, None)
