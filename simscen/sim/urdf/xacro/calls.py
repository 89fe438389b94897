"""Which macro a call means, and what its parameters are in it."""

from simscen.sim.urdf.markup import Element
from simscen.sim.urdf.xacro.budget import Refused
from simscen.sim.urdf.xacro.macros import Macro, Macros, Parameter
from simscen.sim.urdf.xacro.scope import Block, Held, Scope
from simscen.sim.urdf.xacro.text import Texts


def called(written: str, scope: Scope, macros: Macros) -> tuple[Macro, Scope, Macros]:
    """The macro `name` or `namespace.name` and the scopes that its own lie in; raises Refused."""
    *spaces, name = written.split(".")
    for space in spaces:
        owner, inner = scope.owner(space), macros.space(space)
        found = owner.held[space] if owner is not None else None
        if inner is None or not isinstance(found, Scope):
            raise Refused(f"there is no namespace {space[:60]!r}")
        scope, macros = found, inner
    macro = macros.find(name)
    if macro is None:
        raise Refused(f"there is no macro {written[:60]!r}")
    return macro, scope, macros


def bind(macro: Macro, call: Element, blocks: list[Element], scope: Scope, inside: Scope, texts: Texts) -> Scope:
    """`inside` with the macro's parameters: all of them mean what they mean in `scope`, where it is called.

    Raises Refused.
    """
    missing = {parameter.name: parameter for parameter in macro.parameters}
    for name, text in call.attributes.items():
        if missing.pop(name, None) is None:
            raise Refused(f"macro {macro.name!r} has no parameter {name[:60]!r}")
        inside.held[name] = texts.literal(text, scope)
    waiting = iter(blocks)
    for name in [parameter.name for parameter in macro.parameters if parameter.is_block]:
        block = next(waiting, None)
        if block is None:
            raise Refused(f"macro {macro.name!r} needs a block for {name!r}")
        inside.held[name] = Block(block, whole=not name.startswith("**"))
        del missing[name]
    if extra := next(waiting, None):
        raise Refused(f"macro {macro.name!r} has no use for <{extra.tag[:60]}>")
    for name, parameter in missing.items():
        inside.held[name] = _default(parameter, scope, macro, texts)
    return inside


def _default(parameter: Parameter, scope: Scope, macro: Macro, texts: Texts) -> Held:
    if parameter.forward and scope.owner(parameter.name) is not None:
        return texts.property(scope, parameter.name)
    if parameter.default is not None:
        return texts.literal(parameter.default, scope)
    what = "there is no property to forward to" if parameter.forward else "a call does not give"
    raise Refused(f"macro {macro.name!r}: {what} {parameter.name!r}")
