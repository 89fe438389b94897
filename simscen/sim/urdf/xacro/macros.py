"""What `<xacro:macro name="…" params="…">` defines."""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field

from simscen.sim.urdf.markup import Element
from simscen.sim.urdf.xacro.budget import Refused

PARAMETER = re.compile(
    r"""\s*(?P<name>[^\s:=]+)\s*
        (?::?=\s*(?P<forward>\^\|?)?(?P<default>\$\{[^}]*\}|\$\([^)]*\)|(?:'''(?=\s|\Z)|'[^']*'|"[^"]*"|[^\s'"])*))?
        (?=\s|\Z)""",
    re.VERBOSE,
)


@dataclass(frozen=True)
class Parameter:
    """A parameter: `*name` and `**name` are blocks; `forward` = take the caller's property of that name first."""

    name: str
    forward: bool = False
    default: str | None = None

    @property
    def is_block(self) -> bool:
        """Whether it takes an element."""
        return self.name.startswith("*")


@dataclass(frozen=True, eq=False)
class Macro:
    """A macro and the element that holds its body."""

    name: str
    parameters: tuple[Parameter, ...]
    body: Element


@dataclass(eq=False)
class Macros:
    """Macros by name, each scope in front of the one around it; `spaces` are included namespaces."""

    parent: "Macros | None" = None
    macros: dict[str, Macro] = field(default_factory=dict)
    spaces: "dict[str, Macros]" = field(default_factory=dict)

    def find(self, name: str) -> Macro | None:
        """The innermost macro of that name."""
        return next((scope.macros[name] for scope in self._outwards() if name in scope.macros), None)

    def space(self, name: str) -> "Macros | None":
        """The innermost namespace of that name."""
        return next((scope.spaces[name] for scope in self._outwards() if name in scope.spaces), None)

    def _outwards(self) -> "Iterator[Macros]":
        scope: Macros | None = self
        while scope is not None:
            yield scope
            scope = scope.parent


def macro_of(element: Element) -> Macro:
    """The macro that an element defines; raises Refused."""
    name = element.name.removeprefix("xacro:")
    if not name or name == "call" or "." in name:
        raise Refused(f"{name[:60]!r} is not a name for a macro")
    return Macro(name, tuple(_parameters(element.attributes.get("params", ""))), element)


def _parameters(text: str) -> list[Parameter]:
    found = []
    position = 0
    while text[position:].strip():
        match = PARAMETER.match(text, position)
        if match is None:
            raise Refused(f"params: cannot read {text[position:].strip()[:60]!r}")
        found.append(Parameter(match["name"], match["forward"] is not None, match["default"] or None))
        position = match.end()
    return found
