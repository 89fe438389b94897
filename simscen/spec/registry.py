"""Registry of types that YAML files select by name: planners, criteria, faults, sensors, and so on.

An installed package (a plug-in) adds a type by an entry point. The value of the entry point is the address of a
specification class (a pydantic model of the YAML):

    [project.entry-points."simscen.criterion"]
    headway = "my_package.headway:Headway"

A package is imported when a file uses one of its types. simscen's advanced components are also added by entry points.
All other types of simscen are built in, so that files without other types do not wait 35 ms for entry points.
"""

from __future__ import annotations

import contextlib
import inspect
import os
import re
import sys
from dataclasses import dataclass, replace
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterator
    from importlib.metadata import Distribution

    from pydantic import BaseModel

ENTRY_POINT_PREFIX = "simscen."
"""Prefix of entry point groups: "simscen.criterion" is the entry point group of the registry group "criterion"."""
_BASE_CLASSES = ("simscen.spec.base:Spec", "simscen.spec.base:Value")
"""Addresses of the base classes of all specifications."""
_NAME_PATTERN = re.compile(r"[a-z][a-z0-9_]{0,59}")
_ADDRESS_PATTERN = re.compile(r"(?P<module>[\w.]+):(?P<name>\w+)")


@dataclass(frozen=True)
class Group:
    """Group of types, such as criteria."""

    base: str
    """Address "module:Class" of the base class of all specifications of the group."""
    built_in: str
    """Address "module:name" of the built-in types: a Choice class, or a dict of addresses by name."""
    reserved: tuple[str, ...] = ()
    """Names that types of plug-ins cannot have, because YAML files use them as keys."""


GROUPS: dict[str, Group] = {
    "stack": Group("simscen.model.stack:InProcessStack", "simscen.model.stack:STACKS", ("external",)),
    "localizer": Group("simscen.model.localizers:LocalizerSpec", "simscen.model.localizers:LOCALIZERS"),
    "planner": Group("simscen.model.planners:PlannerSpec", "simscen.model.planners:PLANNERS"),
    "controller": Group("simscen.model.controllers:ControllerSpec", "simscen.model.controllers:CONTROLLERS"),
    "behavior": Group("simscen.model.recovery:BehaviorSpec", "simscen.model.recovery:BEHAVIORS"),
    "goal_checker": Group("simscen.model.controllers:GoalCheckerSpec", "simscen.model.controllers:GOAL_CHECKERS"),
    "criterion": Group(
        "simscen.criteria.base:Criterion", "simscen.criteria.registry:AnyCriterion", ("id", "severity", "then")
    ),
    "fault": Group(
        "simscen.faults.base:Fault", "simscen.faults.base:AnyFault", ("sensor", "when", "for", "name", "required")
    ),
    "trigger": Group(
        "simscen.triggers.base:Condition",
        "simscen.triggers.base:AnyCondition",
        ("for", "robot", "edge", "delay", "times", "probability", "all", "any", "not"),
    ),
    "action": Group("simscen.actions.base:Action", "simscen.actions.base:AnyAction", ("robot",)),
    "sensor": Group("simscen.model.sensors:SensorSpec", "simscen.model.sensors:Sensor"),
    "metric": Group("simscen.criteria.base:Measure", "simscen.judge.metrics.catalog:ADDRESSES", ("metrics",)),
}
"""All groups by name."""


@dataclass(frozen=True)
class RegisteredType:
    """Registered type, built-in or from an installed package."""

    group: str
    name: str
    value: str
    """Address "module:Class" of the specification class."""
    distribution: str = ""
    """Name of the package that adds the type; "" for a built-in type."""
    version: str = ""
    """Version of this package; "" for a built-in type."""
    problem: str = ""
    """Reason why the type cannot be used; "" if none is known before the package is imported."""
    folder: str = ""
    """Folder in which the package is installed; "" for a built-in type."""

    @property
    def is_shipped(self) -> bool:
        """Whether simscen ships this type, built-in or advanced."""
        return self.distribution in ("", "simscen")

    @property
    def origin(self) -> str:
        """Package and version for messages, e.g. "headway 1.2"; "simscen" for a built-in type."""
        return f"{self.distribution} {self.version}".strip() or "simscen"

    def load(self) -> type[BaseModel]:
        """Import the module and return the specification class. Raises BrokenPlugin."""
        if self.problem:
            raise BrokenPlugin(self, self.problem)
        return _load(self)


class BrokenPlugin(Exception):
    """A type of an installed package cannot be used, for a `reason`. `hint` is the next step for the user."""

    def __init__(self, entry: RegisteredType, reason: str, hint: str = "") -> None:
        self.entry, self.reason = entry, reason
        self.hint = hint or "`simscen plugins` lists what installed packages add"
        super().__init__(f"{entry.group} `{entry.name}` of {entry.origin} cannot be used: {reason}")


def built_in_types(group: str) -> tuple[RegisteredType, ...]:
    """Return the built-in types of a group."""
    types = _import_address(GROUPS[group].built_in)
    values: dict[str, str] = types if isinstance(types, dict) else types.addresses()
    return tuple(RegisteredType(group, name, value) for name, value in values.items())


def built_in_specs(group: str) -> dict[str, type[BaseModel]]:
    """Return the specification classes of the built-in types of a group, by name of the type."""
    return {entry.name: entry.load() for entry in built_in_types(group)}


def installed_types(group: str) -> tuple[RegisteredType, ...]:
    """Return the types that entry points of simscen and other packages add to a group, sorted by name.

    Unusable types are included.
    """
    return tuple(entry for entry in _all_installed_types() if entry.group == group)


def plugin_types(group: str) -> tuple[RegisteredType, ...]:
    """Return the types that packages except simscen add to a group, sorted by name. Unusable types are included."""
    return tuple(entry for entry in installed_types(group) if not entry.is_shipped)


def installed_specs(group: str, with_plugins: bool = True) -> dict[str, type[BaseModel]]:
    """Return the usable specification classes that entry points add to a group, by name of the type.

    With `with_plugins` false, only the entry points of simscen count.
    """
    specs = {}
    for entry in installed_types(group):
        if not (entry.is_shipped or with_plugins):
            continue
        with contextlib.suppress(BrokenPlugin):
            specs[entry.name] = entry.load()
    return specs


def all_types(group: str) -> tuple[RegisteredType, ...]:
    """Return all types of a group: built-in types, then types of installed packages with other names."""
    built_in = built_in_types(group)
    names = {entry.name for entry in built_in}
    return (*built_in, *(entry for entry in installed_types(group) if entry.name not in names))


def find_type(group: str, name: str) -> RegisteredType | None:
    """Return the type with this name; None if there is none. A built-in type has priority."""
    types = (entry for types in (built_in_types, installed_types) for entry in types(group))
    return next((entry for entry in types if entry.name == name), None)


def types_without_group() -> tuple[RegisteredType, ...]:
    """Return the types that installed packages add to groups `simscen.…` that do not exist.

    For each package with a damaged entry_points.txt, also return an entry with the problem.
    """
    return tuple(entry for entry in _all_installed_types() if entry.group not in GROUPS)


def plugins_with_spec(spec: type) -> tuple[RegisteredType, ...]:
    """Return the types of installed packages whose specification is this class; () if simscen ships the class."""
    package = spec.__module__.partition(".")[0]
    found = []
    for entry in () if package == "simscen" else _all_installed_types():
        if re.split("[.:]", entry.value)[0] == package:
            with contextlib.suppress(BrokenPlugin):
                found += [entry] if entry.load() is spec else []
    return tuple(found)


@cache
def _all_installed_types() -> tuple[RegisteredType, ...]:
    """Return all types of installed packages, sorted by group and name. If names are equal, simscen's type is first."""
    found = sorted(
        set(_read_installed_types()),
        key=lambda e: (e.group, e.name, not e.is_shipped, e.distribution, e.version, e.value),
    )
    return tuple(replace(entry, problem=entry.problem or _type_problem(entry, found)) for entry in found)


def _read_installed_types() -> Iterator[RegisteredType]:
    """Yield the types of all packages on the search path. If a package is there twice, the first one counts."""
    from importlib.metadata import distributions

    seen: set[str] = set()
    for package in distributions(path=search_path()):
        if not _mentions_simscen(package):  # reading the names of all packages would take ten times longer
            continue
        name, version = package.metadata["Name"], package.metadata["Version"] or ""
        key = re.sub("[-_.]+", "-", name or "").lower()
        if key and key in seen:
            continue
        seen.add(key)
        owner = (name or "an unnamed package", version)  # an incomplete installation has no METADATA
        folder = str(package.locate_file(""))
        try:
            points = [(point.group, point.name, point.value) for point in package.entry_points]
        except (ValueError, TypeError, LookupError) as error:  # raised by importlib.metadata for damaged files
            problem = f"its entry_points.txt is damaged: {error}"
            yield RegisteredType("", "", "entry_points.txt", *owner, problem, folder)
            continue
        for group, point, value in points:
            if group.startswith(ENTRY_POINT_PREFIX):
                yield RegisteredType(group.removeprefix(ENTRY_POINT_PREFIX), point, value, *owner, folder=folder)


def _mentions_simscen(package: Distribution) -> bool:
    """Return whether the entry points of a package mention simscen. This reads only one file."""
    try:
        return ENTRY_POINT_PREFIX in (package.read_text("entry_points.txt") or "")
    except UnicodeDecodeError as error:
        return ENTRY_POINT_PREFIX.encode() in error.object


def search_path() -> list[str]:
    """Return sys.path without the working directory and the folder of the program, unless PYTHONPATH names them.

    Packages that lie next to scenarios must not run code.
    """
    program = getattr(sys.modules.get("__main__"), "__file__", None)
    implicit = {"", str(Path.cwd()), *([str(Path(program).absolute().parent)] if program else [])}
    python_path = os.environ.get("PYTHONPATH", "").split(os.pathsep)
    explicit = {str(Path(folder).absolute()) for folder in python_path if folder}
    return [folder for folder in sys.path if folder not in implicit - explicit]


def _type_problem(entry: RegisteredType, installed: list[RegisteredType]) -> str:
    """Return the reason why a type cannot be used, found without importing its package; "" if there is none."""
    group = GROUPS.get(entry.group)
    if group is None:
        return f"there is no group `{ENTRY_POINT_PREFIX}{entry.group}`"
    if not _NAME_PATTERN.fullmatch(entry.name):
        return "its name must start with a lowercase letter and consist of lowercase letters, digits, and `_`"
    if entry.name in group.reserved:
        return f"the name `{entry.name}` is reserved"
    others = [other for other in installed if (other.group, other.name) == (entry.group, entry.name)]
    shipped_names = {other.name for other in (*built_in_types(entry.group), *others) if other.is_shipped}
    if not entry.is_shipped and entry.name in shipped_names:
        return "simscen ships a type with the same name, which takes precedence"
    others = [other for other in others if other.is_shipped == entry.is_shipped]
    if len(others) > 1:
        return "added by " + " and by ".join(f"{other.origin} ({other.value})" for other in others)
    if not _ADDRESS_PATTERN.fullmatch(entry.value):
        return f"`{entry.value}` is not of the form package.module:Class"
    return ""


@cache
def _load(entry: RegisteredType) -> type[BaseModel]:
    module, _, name = entry.value.partition(":")
    try:
        # Output of a module during import must not get into output that programs read.
        with contextlib.redirect_stdout(sys.stderr):
            model = getattr(import_module(module), name, None)
        if (problem := _specification_problem(entry, model)) is None:
            model.model_rebuild()  # type: ignore[union-attr]
    except (Exception, SystemExit) as error:  # code of other packages can raise anything
        cause = f"{type(error).__name__}: {error}".splitlines()[0]
        hint = f"`{sys.executable} -c 'import {module}'` shows the traceback"
        raise BrokenPlugin(entry, f"`{entry.value}` cannot be loaded: {cause}", hint) from error
    if problem is not None:
        raise BrokenPlugin(entry, problem)
    return model  # type: ignore[return-value]


def _specification_problem(entry: RegisteredType, model: Any) -> str | None:
    """Return the reason why `model` is not a valid specification class of the group; None if it is valid."""
    if model is None:
        return f"`{entry.value}` does not exist"
    if not isinstance(model, type) or not issubclass(model, tuple(map(_import_address, _BASE_CLASSES))):
        return f"`{entry.value}` is not a subclass of simscen.plugin.Spec or simscen.plugin.Value"
    base = _import_address(GROUPS[entry.group].base)
    if not issubclass(model, base):
        return f"`{entry.value}` is not a subclass of simscen.plugin.{base.__name__}"
    if inspect.isabstract(model):
        missing = ", ".join(sorted(getattr(model, "__abstractmethods__", ())))
        return f"`{entry.value}` does not implement {missing}"
    problem = model.definition_problem() if hasattr(model, "definition_problem") else ""
    return f"`{entry.value}`: {problem}" if problem else None


def _import_address(address: str) -> Any:
    module, _, name = address.partition(":")
    return getattr(import_module(module), name)
