"""Evaluates xacro texts with `${expressions}` and `$(substitutions)` in nested scopes of properties."""

import re
from collections.abc import Mapping
from pathlib import Path

from simscen.assets.folders import AllowedFolders, UnusableFile
from simscen.sim.urdf.xacro.expression import Functions, evaluate, lookup
from simscen.sim.urdf.xacro.limits import MAX_LENGTH, Budget, ExpansionError, MissingFile, Value, parse_literal
from simscen.sim.urdf.xacro.scopes import Block, EvaluationMarker, LazyText, Scope
from simscen.sim.urdf.xml_source import Element

MAX_YAML_BYTES = 1 << 20
"""Maximum size of a file that `xacro.load_yaml` reads."""
TOKEN = re.compile(r"\$\$+[{(]|\$\{[^}]*\}|\$\([^)]*\)|[^$]+|\$[^{($]+|\$\Z")
"""Pattern of a part of a text: an escaped `$${` or `$$(`, an expression, a substitution, or plain text."""


class TextEvaluator:
    """Evaluates texts of a xacro file. `arguments` are the values of `<xacro:arg>` by name.

    `file` is the file whose texts are evaluated; it changes during the expansion of an included file.
    """

    def __init__(self, folders: AllowedFolders, file: Path, budget: Budget, arguments: Mapping[str, str]) -> None:
        self.budget, self.file = budget, file
        self.arguments = dict(arguments)
        self._folders = folders
        self._functions: Functions = {("xacro", "load_yaml"): self._load_yaml, ("load_yaml",): self._load_yaml}

    def value(self, text: str, scope: Scope) -> Value:
        """Return the value of a text: a value of any type for a single expression, else text. Raises ExpansionError."""
        self.budget.spend(1 + len(text) // 16)
        if "$" not in text:
            return text
        parts: list[Value] = []
        position = 0
        while position < len(text):
            token = TOKEN.match(text, position)
            if token is None:
                rest = text[position : position + 60]
                raise ExpansionError(f"{rest!r}: `$` does not begin a complete `${{…}}` or `$(…)`")
            parts.append(self._part(token[0], scope))
            position = token.end()
        if len(parts) == 1:
            return parts[0]
        joined = "".join(map(str, parts))
        if len(joined) > MAX_LENGTH:
            raise ExpansionError(f"a text is longer than {MAX_LENGTH} characters")
        return joined

    def text(self, text: str, scope: Scope) -> str:
        """Return the value of a text as a string; raises ExpansionError."""
        return str(self.value(text, scope))

    def literal(self, text: str, scope: Scope) -> Value:
        """Return the value of a text, converted to a number or boolean if possible; raises ExpansionError."""
        value = self.value(text, scope)
        return parse_literal(value) if isinstance(value, str) else value

    def property(self, scope: Scope, name: str) -> "Value | Scope":
        """Return the property or namespace with this name that is visible in `scope`.

        Raises KeyError if it does not exist, and ExpansionError if it cannot be evaluated.
        """
        owner = scope.find_scope(name)
        if owner is None:
            raise KeyError(name)
        match owner.values[name]:
            case LazyText(text) as lazy:
                owner.values[name] = EvaluationMarker()
                try:
                    with self.budget:
                        value = self.literal(text, owner)
                except ExpansionError:
                    owner.values[name] = lazy
                    raise
                owner.values[name] = value
                return value
            case EvaluationMarker():
                raise ExpansionError(f"the property {name!r} refers to itself")
            case Block():
                raise KeyError(name)
            case found:
                return found

    def _property_at(self, path: tuple[str, ...], scope: Scope) -> Value:
        """Return the property `a.b`, given as ("a", "b"); raises KeyError if it does not exist."""
        current: Value | Scope = scope
        for name in path:
            current = self.property(current, name) if isinstance(current, Scope) else lookup(current, name)
        if isinstance(current, Scope):
            raise KeyError(path[-1])
        return current

    def _part(self, token: str, scope: Scope) -> Value:
        """Return the value of one part of a text, which matches TOKEN."""
        if token.startswith("$$"):
            return token[1:]
        if token.startswith("${"):
            expression = str(self.value(token[2:-1], scope))
            try:
                return self._evaluate(expression, scope)
            except ExpansionError as error:
                if error.message.startswith("${"):
                    raise
                raise ExpansionError(f"${{{expression[:100]}}}: {error.message}", error.hint) from None
        if token.startswith("$("):
            return self._substitute(str(self.value(token[2:-1], scope)))
        return token

    def _evaluate(self, expression: str, scope: Scope) -> Value:
        return evaluate(expression, lambda path: self._property_at(path, scope), self.budget, self._functions)

    def _load_yaml(self, filename: object) -> object:
        """Return the content of a YAML file, as `xacro.load_yaml` does; raises ExpansionError."""
        from simscen.assets.yaml_values import parse_yaml_values

        if not isinstance(filename, str):
            raise ExpansionError("load_yaml() takes the path of a file")
        try:
            path = self._folders.find(filename, self.file.parent, allow_absolute=True)
            _, content = self._folders.read_file(path, MAX_YAML_BYTES)
            return parse_yaml_values(content, self._number)
        except UnusableFile as error:
            raise ExpansionError(f"{filename[:200]!r}: {error}", error.hint) from error

    def _number(self, expression: str) -> float:
        """Return the number of an expression without properties; raises ExpansionError."""
        value = self._evaluate(expression, Scope())
        if not isinstance(value, int | float):
            raise ExpansionError(f"{expression[:60]!r} is not a number")
        return value

    def _substitute(self, command: str) -> str:
        """Return the value of a substitution such as `arg NAME` or `find PACKAGE`; raises ExpansionError."""
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
                try:
                    return str(self._folders.package_folder(package, self.file.parent))
                except UnusableFile as error:
                    raise MissingFile(f"$(find {package[:60]}): {error}", error.hint) from None
            case ["dirname"]:
                return str(self.file.parent)
            case ["env", *_]:
                raise ExpansionError(f"$({command[:60]}): the environment is not read", "write the value into the file")
            case _:
                raise ExpansionError(f"$({command[:60]}) is not supported", "use arg, find, dirname, or optenv")


def required_attribute(element: Element, attribute: str, may_be_empty: bool = False) -> str:
    """Return the unevaluated text of a required attribute; raises ExpansionError if it is missing or empty."""
    text = element.attributes.get(attribute)
    if text is None or not (text or may_be_empty):
        raise ExpansionError(f'<{element.tag[:60]}> without {attribute}="…"')
    return text
