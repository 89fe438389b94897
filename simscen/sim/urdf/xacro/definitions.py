"""Definitions in xacro files: parses macros, binds the arguments of macro calls, and defines properties."""

import re

from simscen.sim.urdf.xacro.limits import ExpansionError, parse_bool, parse_literal
from simscen.sim.urdf.xacro.scopes import Block, LazyText, Macro, Parameter, Scope, ScopeValue
from simscen.sim.urdf.xacro.text import TextEvaluator, required_attribute
from simscen.sim.urdf.xml_source import Element

PARAMETER = re.compile(
    r"""\s*(?P<name>[^\s:=]+)\s*
        (?::?=\s*(?P<forward>\^\|?)?(?P<default>\$\{[^}]*\}|\$\([^)]*\)|(?:'''(?=\s|\Z)|'[^']*'|"[^"]*"|[^\s'"])*))?
        (?=\s|\Z)""",
    re.VERBOSE,
)
"""One parameter in `params`, such as `name`, `*block`, `name:=default`, or `name:=^|default`."""


def parse_macro(element: Element) -> Macro:
    """Parse a macro definition; raises ExpansionError."""
    name = element.name.removeprefix("xacro:")
    if not name or name == "call" or "." in name:
        raise ExpansionError(f"{name[:60]!r} is not a valid name of a macro")
    return Macro(name, tuple(_parse_parameters(element.attributes.get("params", ""))), element)


def _parse_parameters(text: str) -> list[Parameter]:
    found = []
    position = 0
    while text[position:].strip():
        match = PARAMETER.match(text, position)
        if match is None:
            raise ExpansionError(f"params: cannot read {text[position:].strip()[:60]!r}")
        found.append(Parameter(match["name"], match["forward"] is not None, match["default"] or None))
        position = match.end()
    return found


def resolve_macro(qualified_name: str, scope: Scope) -> tuple[Macro, Scope]:
    """Return the macro `name` or `namespace.name`, and the scope that encloses the body of the macro.

    This scope is the scope of the namespace; without a namespace, it is `scope`, the scope of the call. Raises
    ExpansionError.
    """
    *namespaces, name = qualified_name.split(".")
    for namespace in namespaces:
        inner = scope.find_namespace(namespace)
        if inner is None:
            raise ExpansionError(f"there is no namespace {namespace[:60]!r}")
        scope = inner
    macro = scope.find_macro(name)
    if macro is None:
        raise ExpansionError(f"there is no macro {qualified_name[:60]!r}")
    return macro, scope


def bind_parameters(
    macro: Macro, call: Element, blocks: list[Element], caller_scope: Scope, body_scope: Scope, texts: TextEvaluator
) -> Scope:
    """Add the arguments of a macro call to the scope of the macro's body, and return this scope.

    `blocks` are the expanded child elements of the call. Raises ExpansionError.
    """
    missing = {parameter.name: parameter for parameter in macro.parameters}
    for name, text in call.attributes.items():
        if missing.pop(name, None) is None:
            raise ExpansionError(f"macro {macro.name!r} has no parameter {name[:60]!r}")
        body_scope.values[name] = texts.literal(text, caller_scope)
    unused_blocks = iter(blocks)
    for name in [parameter.name for parameter in macro.parameters if parameter.is_block]:
        block = next(unused_blocks, None)
        if block is None:
            raise ExpansionError(f"macro {macro.name!r} needs a block for {name!r}")
        body_scope.values[name] = Block(block, includes_element=not name.startswith("**"))
        del missing[name]
    if extra := next(unused_blocks, None):
        raise ExpansionError(f"macro {macro.name!r} has no parameter for the block <{extra.tag[:60]}>")
    for name, parameter in missing.items():
        body_scope.values[name] = _default_value(parameter, caller_scope, macro, texts)
    return body_scope


def _default_value(parameter: Parameter, caller_scope: Scope, macro: Macro, texts: TextEvaluator) -> ScopeValue:
    """Return the value of a parameter for which the call has no argument. Raises ExpansionError."""
    if parameter.is_forwarded and caller_scope.find_scope(parameter.name) is not None:
        return texts.property(caller_scope, parameter.name)
    if parameter.default is not None:
        return texts.literal(parameter.default, caller_scope)
    reason = "there is no property to forward to" if parameter.is_forwarded else "a call lacks the argument"
    raise ExpansionError(f"macro {macro.name!r}: {reason} {parameter.name!r}")


def define_property(source: Element, scope: Scope, texts: TextEvaluator) -> None:
    """Execute a `<xacro:property>`: define a property, set its default, or remove it. Raises ExpansionError."""
    name = texts.text(required_attribute(source, "name"), scope)
    if not name.isidentifier() or name.startswith("__"):
        raise ExpansionError(f"{name[:60]!r} is not a valid name of a property")
    value, default = source.attributes.get("value"), source.attributes.get("default")
    must_remove = parse_bool(texts.value(source.attributes.get("remove", "false"), scope))
    if (value is not None) + (default is not None) + must_remove > 1:
        raise ExpansionError("value, default and remove exclude each other")
    is_defined = scope.find_scope(name) is not None
    if must_remove and is_defined:
        scope.remove(name)
    elif default is None or not is_defined:
        _set_property(source, name, value if default is None else default, scope, texts)


def _set_property(source: Element, name: str, value: str | None, scope: Scope, texts: TextEvaluator) -> None:
    """Set a property to `value`, or to the children of `source` if `value` is None."""
    is_lazy = parse_bool(texts.value(source.attributes.get("lazy_eval", "true"), scope))
    target = {"global": scope.top(), "parent": scope.caller()}.get(source.attributes.get("scope", ""), scope)
    if value is None:
        target.values[f"**{name}"] = Block(source, includes_element=False)
    elif is_lazy and target is scope:
        literal = parse_literal(value)
        target.values[name] = LazyText(literal) if isinstance(literal, str) else literal
    else:
        target.values[name] = texts.literal(value, scope)
