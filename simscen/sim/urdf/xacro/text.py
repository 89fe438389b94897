"""Evaluates text with `${expressions}` and `$(substitutions)` in nested scopes of properties."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Union

from simscen.assets.folders import AllowedFolders, UnusableFile
from simscen.sim.urdf.xacro.expression import evaluate
from simscen.sim.urdf.xacro.limits import MAX_LENGTH, Budget, ExpansionError, MissingFile, Value, parse_literal
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


TOKEN = re.compile(r"\$\$+[{(]|\$\{[^}]*\}|\$\([^)]*\)|[^$]+|\$[^{($]+|\$\Z")


class TextEvaluator:
    """Evaluates texts; `file` is the one being expanded, `arguments` are those of `<xacro:arg>`."""

    def __init__(self, folders: AllowedFolders, file: Path, budget: Budget, arguments: Mapping[str, str]) -> None:
        self.budget, self.file = budget, file
        self.arguments = dict(arguments)
        self._folders = folders

    def value(self, text: str, scope: Scope) -> Value:
        """Evaluate a text in a scope; a single expression keeps its type. Raises ExpansionError."""
        self.budget.spend(1 + len(text) // 16)
        if "$" not in text:
            return text
        parts: list[Value] = []
        position = 0
        while position < len(text):
            token = TOKEN.match(text, position)
            if token is None:
                raise ExpansionError(f"{text[position : position + 60]!r}: a bracket is not closed")
            parts.append(self._part(token[0], scope))
            position = token.end()
        if len(parts) == 1:
            return parts[0]
        joined = "".join(map(str, parts))
        if len(joined) > MAX_LENGTH:
            raise ExpansionError(f"a text is longer than {MAX_LENGTH} characters")
        return joined

    def text(self, text: str, scope: Scope) -> str:
        """Evaluate a text and return text; raises ExpansionError."""
        return str(self.value(text, scope))

    def literal(self, text: str, scope: Scope) -> Value:
        """Evaluate a text and convert it to a number or boolean if it is one; raises ExpansionError."""
        value = self.value(text, scope)
        return parse_literal(value) if isinstance(value, str) else value

    def property(self, scope: Scope, name: str) -> "Value | Scope":
        """Return a property of a scope, evaluated on first use; raises KeyError or ExpansionError."""
        owner = scope.owner(name)
        if owner is None:
            raise KeyError(name)
        match owner.values[name]:
            case Lazy(text) as lazy:
                owner.values[name] = Resolving()
                try:
                    with self.budget:
                        value = self.literal(text, owner)
                except ExpansionError:
                    owner.values[name] = lazy
                    raise
                owner.values[name] = value
                return value
            case Resolving():
                raise ExpansionError(f"the property {name!r} is defined by itself")
            case Block():
                raise KeyError(name)
            case found:
                return found

    def _part(self, token: str, scope: Scope) -> Value:
        if token.startswith("$$"):
            return token[1:]
        if token.startswith("${"):
            expression = str(self.value(token[2:-1], scope))
            try:
                return evaluate(expression, _ScopeNames(self, scope), self.budget)
            except ExpansionError as error:
                if error.message.startswith("${"):
                    raise
                raise ExpansionError(f"${{{expression[:100]}}}: {error.message}", error.hint) from None
        if token.startswith("$("):
            return self._substitute(str(self.value(token[2:-1], scope)))
        return token

    def _substitute(self, command: str) -> str:
        match command.split():
            case ["arg", name] if name in self.arguments:
                return self.arguments[name]
            case ["arg", name]:
                raise ExpansionError(
                    f"$(arg {name[:60]}): there is no such argument", 'give it a <xacro:arg default="…">'
                )
            case ["optenv", _, *default]:
                return " ".join(default)  # a run must not depend on the environment
            case ["find", package]:
                return self._package(package)
            case ["dirname"]:
                return str(self.file.parent)
            case ["env", *_]:
                raise ExpansionError(f"$({command[:60]}): the environment is not read", "write the value into the file")
            case _:
                raise ExpansionError(f"$({command[:60]}) is not supported", "use arg, find, dirname, or optenv")

    def _package(self, name: str) -> str:
        try:
            return str(self._folders.package_folder(name, self.file.parent))
        except UnusableFile as trouble:
            raise MissingFile(f"$(find {name[:60]}): {trouble}", trouble.hint) from None


class _ScopeNames:
    def __init__(self, texts: TextEvaluator, scope: Scope) -> None:
        self._texts, self._scope = texts, scope

    def value(self, path: tuple[str, ...]) -> Value:
        current: Value | Scope = self._scope
        for name in path:
            if not isinstance(current, Scope):
                raise KeyError(name)
            current = self._texts.property(current, name)
        if isinstance(current, Scope):
            raise KeyError(path[-1])
        return current


def required_attribute(element: Element, attribute: str, empty: bool = False) -> str:
    """Return a required attribute without evaluation; raises ExpansionError if it is missing."""
    text = element.attributes.get(attribute)
    if text is None or not (text or empty):
        raise ExpansionError(f'<{element.tag[:60]}> without {attribute}="…"')
    return text
