"""What `<xacro:property>` defines."""

from simscen.sim.urdf.markup import Element
from simscen.sim.urdf.xacro.budget import Refused
from simscen.sim.urdf.xacro.scope import Block, Lazy, Scope
from simscen.sim.urdf.xacro.text import Texts, needed
from simscen.sim.urdf.xacro.values import literal, truth


def define(source: Element, scope: Scope, texts: Texts) -> None:
    """Define, default or remove a property; raises Refused."""
    name = texts.text(needed(source, "name"), scope)
    if not name.isidentifier() or name.startswith("__"):
        raise Refused(f"{name[:60]!r} is not a name for a property")
    value, default = source.attributes.get("value"), source.attributes.get("default")
    remove = truth(texts.value(source.attributes.get("remove", "false"), scope))
    if (value is not None) + (default is not None) + remove > 1:
        raise Refused("value, default and remove exclude each other")
    known = scope.owner(name) is not None
    if remove and known:
        scope.remove(name)
    elif default is None or not known:
        _set(source, name, value if default is None else default, scope, texts)


def _set(source: Element, name: str, value: str | None, scope: Scope, texts: Texts) -> None:
    lazy = truth(texts.value(source.attributes.get("lazy_eval", "true"), scope))
    where = source.attributes.get("scope", "")
    into = {"global": scope.top(), "parent": scope.caller()}.get(where, scope)
    if value is None:
        into.held[f"**{name}"] = Block(source, whole=False)
    elif lazy and into is scope:
        plain = literal(value)
        into.held[name] = Lazy(plain) if isinstance(plain, str) else plain
    else:
        into.held[name] = texts.literal(value, scope)
