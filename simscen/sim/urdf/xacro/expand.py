"""Expands a xacro file (wiki.ros.org/xacro) to URDF elements that keep their file and line."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from pathlib import Path

from simscen.assets.folders import AllowedFolders, NoSuchFile, UnusableFile
from simscen.core.errors import InvalidInput, Problem
from simscen.sim.urdf.xacro.definitions import bind_parameters, define_property, parse_macro, resolve_macro
from simscen.sim.urdf.xacro.limits import Budget, ExpansionError, MissingFile, parse_bool
from simscen.sim.urdf.xacro.scopes import Block, Macro, Scope
from simscen.sim.urdf.xacro.text import TextEvaluator, required_attribute
from simscen.sim.urdf.xml_source import MAX_URDF_BYTES, Element

MAX_FILES = 200
"""Maximum number of included files."""
MAX_ELEMENTS = 100_000
"""Maximum number of elements after expansion."""

FileReader = Callable[[Path], Element]
"""Reads a file inside the allowed folders; raises InvalidInput."""


class UnknownArgument(InvalidInput):
    """Error for an argument that no `<xacro:arg>` declares. `declared` are the names of the declared arguments."""

    def __init__(self, robot: Element, name: str, declared: Iterable[str]) -> None:
        self.name, self.declared = name, sorted(declared)
        listed = ", ".join(self.declared) or "none"
        super().__init__([robot.problem(f"no <xacro:arg> is called {name[:60]!r}", f"declared arguments: {listed}")])


def expand(
    robot: Element, file: Path, folders: AllowedFolders, read: FileReader, arguments: Mapping[str, str] | None = None
) -> Element:
    """Return the expansion of the element `robot` of a xacro `file`; `arguments` override defaults of `<xacro:arg>`.

    `read` reads included files, which must be in `folders`. Raises InvalidInput, or UnknownArgument for an argument
    that is not declared.
    """
    container = replace(robot, tag="", attributes={}, children=[])
    expansion = _Expansion(file, folders, read, arguments or {})
    try:
        expansion.element(robot, container, Scope())
    except InvalidInput:
        if not expansion.missing:
            raise
    if expansion.missing:  # without these files, other errors follow
        raise InvalidInput(list(expansion.missing.values()))
    declared = expansion.declared | declared_arguments(robot)
    for name in arguments or {}:
        if name not in declared:
            raise UnknownArgument(robot, name, declared)
    return container.children[0]


def declared_arguments(element: Element) -> set[str]:
    """Return the names of all arguments that an element and its descendants declare."""
    names = {element.name} if element.tag == "xacro:arg" else set()
    return names.union(*map(declared_arguments, element.children))


class _Expansion:
    """Expansion of one file. Most private methods are handlers of one xacro element, such as `_if` of `<xacro:if>`.

    A handler appends the expansion of the element `source` to the children of `target`. `scope` has the visible
    definitions.
    """

    def __init__(self, file: Path, folders: AllowedFolders, read: FileReader, arguments: Mapping[str, str]) -> None:
        self._budget = Budget()
        self._texts = TextEvaluator(folders, file, self._budget, arguments)
        self.declared: set[str] = set()
        """Names of the declared arguments in included files and in expanded elements."""
        self.missing: dict[str, Problem] = {}
        """Problems of missing included files by message."""
        self._folders, self._read_file = folders, read
        self._included: dict[Path, Element] = {}
        """Root elements of the included files."""
        self._calls: list[tuple[Macro, Element]] = []
        """Macros that are being expanded, each with the element of its call, outermost first."""
        self._element_count, self._byte_count = 0, 0
        self._handlers = {
            "xacro:property": lambda source, _, scope: define_property(source, scope, self._texts),
            "xacro:macro": self._macro,
            "xacro:arg": self._argument,
            "xacro:include": self._include,
            "xacro:if": self._if,
            "xacro:unless": self._if,
            "xacro:insert_block": self._insert,
            "xacro:attribute": self._attribute,
            "xacro:element": self._element,
            "xacro:call": self._call_by_name,
        }

    def element(self, source: Element, target: Element, scope: Scope) -> None:
        """Append the expansion of an element to the children of `target`."""
        try:
            with self._budget:
                self._budget.spend()
                default_handler = self._call if source.tag.startswith("xacro:") else self._copy
                self._handlers.get(source.tag, default_handler)(source, target, scope)
        except ExpansionError as error:
            calls = [f"in macro {m.name!r}, called at {e.source.name}:{e.line}" for m, e in self._calls[-1:]]
            hint = "; ".join(filter(None, [error.hint, *calls]))
            raise InvalidInput([source.problem(error.message, hint)]) from error

    def _expand_children(self, source: Element, target: Element, scope: Scope) -> None:
        for child in source.children:
            self.element(child, target, scope)

    def _copy(self, source: Element, target: Element, scope: Scope) -> None:
        """Append a copy of an element that is not a xacro element."""
        attributes = {
            name: self._texts.text(text, scope)
            for name, text in source.attributes.items()
            if not name.startswith("xacro:") and name != "xmlns:xacro"
        }
        self._element_count += 1
        self._byte_count += len(source.tag) + sum(len(name) + len(text) for name, text in attributes.items())
        if self._element_count > MAX_ELEMENTS or self._byte_count > MAX_URDF_BYTES:
            raise ExpansionError(f"more than {MAX_ELEMENTS} elements or {MAX_URDF_BYTES // 2**20} MiB when expanded")
        copy = replace(source, attributes=attributes, children=[])
        target.children.append(copy)
        self._expand_children(source, copy, scope)

    def _macro(self, source: Element, target: Element, scope: Scope) -> None:
        macro = parse_macro(source)
        scope.macros[macro.name] = macro

    def _argument(self, source: Element, target: Element, scope: Scope) -> None:
        name = required_attribute(source, "name")
        self.declared.add(name)
        if name not in self._texts.arguments:
            self._texts.arguments[name] = self._texts.text(
                required_attribute(source, "default", may_be_empty=True), scope
            )

    def _if(self, source: Element, target: Element, scope: Scope) -> None:
        if parse_bool(self._texts.value(required_attribute(source, "value"), scope)) is (source.tag == "xacro:if"):
            self._expand_children(source, target, scope)

    def _attribute(self, source: Element, target: Element, scope: Scope) -> None:
        name = self._texts.text(required_attribute(source, "name"), scope)
        target.attributes[name] = self._texts.text(required_attribute(source, "value", may_be_empty=True), scope)

    def _element(self, source: Element, target: Element, scope: Scope) -> None:
        tag = self._texts.text(required_attribute(source, "xacro:name"), scope)
        self.element(replace(source, tag=tag), target, scope)

    def _insert(self, source: Element, target: Element, scope: Scope) -> None:
        name = required_attribute(source, "name")
        for key in (f"**{name}", f"*{name}"):
            owner = scope.find_scope(key)
            if owner is not None and isinstance(block := owner.values[key], Block):
                insert = self._copy if block.includes_element else self._expand_children
                insert(block.element, target, scope)
                return
        raise ExpansionError(f"there is no block {name[:60]!r}")

    def _call_by_name(self, source: Element, target: Element, scope: Scope) -> None:
        name = self._texts.text(required_attribute(source, "macro"), scope)
        arguments = {key: value for key, value in source.attributes.items() if key != "macro"}
        self._call(replace(source, tag=f"xacro:{name}", attributes=arguments), target, scope)

    def _call(self, source: Element, target: Element, scope: Scope) -> None:
        self._budget.spend(10)
        macro, enclosing = resolve_macro(source.tag.removeprefix("xacro:"), scope)
        blocks = replace(source, attributes={}, children=[])
        self._expand_children(source, blocks, scope)
        body_scope = bind_parameters(macro, source, blocks.children, scope, Scope(enclosing), self._texts)
        self._calls.append((macro, source))
        self._expand_children(macro.body, target, body_scope)
        self._calls.pop()

    def _include(self, source: Element, target: Element, scope: Scope) -> None:
        try:
            self._include_file(source, target, scope)
        except MissingFile as error:
            self.missing.setdefault(error.message, source.problem(error.message, error.hint))

    def _include_file(self, source: Element, target: Element, scope: Scope) -> None:
        filename = self._texts.text(required_attribute(source, "filename"), scope)
        if namespace := self._texts.text(source.attributes.get("ns", ""), scope):
            enclosing, scope = scope, Scope(scope, is_namespace=True)
            enclosing.values[namespace] = scope
        try:
            found = self._folders.find(filename, self._texts.file.parent, allow_absolute=True)
            path = self._folders.check_file(found, MAX_URDF_BYTES)
        except UnusableFile as error:
            if isinstance(error, NoSuchFile) and parse_bool(source.attributes.get("optional", "false")):
                return
            raise MissingFile(f"include {filename[:200]!r}: {error}", error.hint) from error
        including_file, self._texts.file = self._texts.file, path
        self._expand_children(self._parse(path), target, scope)
        self._texts.file = including_file

    def _parse(self, path: Path) -> Element:
        """Return the root element of an included file; reads each file once."""
        if path not in self._included:
            if len(self._included) >= MAX_FILES:
                raise ExpansionError(f"more than {MAX_FILES} files are included")
            self._included[path] = self._read_file(path)
            self.declared |= declared_arguments(self._included[path])
        return self._included[path]
