"""Registry of the types that files can use by name: shipped types, and types that installed packages add.

A package adds a type by an entry point in a group `simscen.<kind>` whose value is the address of a specification:

    [project.entry-points."simscen.criterion"]
    headway = "my_package.headway:Headway"

Searching the installed packages takes 30 ms (importlib.metadata), so it is done once, and only if a file uses a name
that simscen does not ship, or if all names are requested. A package is imported when a file uses one of its types.
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

PREFIX = "simscen."
_BASE_CLASSES = ("simscen.spec.base:Spec", "simscen.spec.base:Value")
_NAME = re.compile(r"[a-z][a-z0-9_]{0,59}")
_ADDRESS = re.compile(r"(?P<module>[\w.]+):(?P<name>\w+)")


@dataclass(frozen=True)
class Group:
    """Kind of types that packages can add, such as criteria.

    `base` is the address of the base class of all specifications of the group. `shipped` is the address of the shipped
    types: a Choice, or a mapping of names to "module:Class". `reserved` names have another meaning in files.
    """

    base: str
    shipped: str = ""
    reserved: tuple[str, ...] = ()


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
    "sensor": Group("simscen.model.robot:SensorSpec", "simscen.model.robot:Sensor"),
    "metric": Group("simscen.criteria.base:Measure", "simscen.judge.metrics.catalog:ADDRESSES", ("metrics",)),
}
"""All groups by kind. The name of a group of entry points is `simscen.<kind>`."""


@dataclass(frozen=True)
class Entry:
    """Type that files can use: its group, name, and the address of its specification, `value` = "module:Class".

    `distribution` and `version` are those of the package that adds the type; "" for a shipped type. `problem` is the
    reason why the type cannot be used, as far as it is known without an import; "" if there is none.
    """

    group: str
    name: str
    value: str
    distribution: str = ""
    version: str = ""
    problem: str = ""
    folder: str = ""
    """Folder of the search path in which the package is installed."""

    @property
    def is_shipped(self) -> bool:
        """Whether simscen ships this type."""
        return not self.distribution

    @property
    def origin(self) -> str:
        """Package and version for messages, e.g. "headway 1.2"."""
        return f"{self.distribution} {self.version}".strip() or "simscen"

    def load(self) -> type[BaseModel]:
        """Import the module and return the specification class. Raises BrokenPlugin."""
        if self.problem:
            raise BrokenPlugin(self, self.problem)
        return _load(self)


class BrokenPlugin(Exception):
    """A type of an installed package cannot be used. `why` is the reason; `hint` says how to find out more."""

    def __init__(self, entry: Entry, why: str, hint: str = "") -> None:
        self.entry, self.why = entry, why
        self.hint = hint or "`simscen plugins` lists what installed packages add"
        super().__init__(f"{entry.group} `{entry.name}` of {entry.origin} cannot be used: {why}")


def shipped(group: str) -> tuple[Entry, ...]:
    """Return the shipped types of a group, in the order of `Group.shipped`."""
    address = GROUPS[group].shipped
    if not address:
        return ()
    types = _resolve(address)
    values: dict[str, str] = types if isinstance(types, dict) else types.addresses()
    return tuple(Entry(group, name, value) for name, value in values.items())


def installed(group: str) -> tuple[Entry, ...]:
    """Return the types that installed packages add to a group, sorted by name, including unusable ones."""
    return tuple(entry for entry in _installed_entries() if entry.group == group)


def entries(group: str) -> tuple[Entry, ...]:
    """Return all types of a group: the shipped types, then the installed types with other names."""
    own = shipped(group)
    names = {entry.name for entry in own}
    return (*own, *(entry for entry in installed(group) if entry.name not in names))


def find(group: str, name: str) -> Entry | None:
    """Return the type with this name, or None. Packages are only searched if no shipped type has the name."""
    own = next((entry for entry in shipped(group) if entry.name == name), None)
    return own or next((entry for entry in installed(group) if entry.name == name), None)


def unknown_groups() -> tuple[Entry, ...]:
    """Return the entry points of packages in groups `simscen.…` that do not exist, probably because of a typo."""
    return tuple(entry for entry in _installed_entries() if entry.group not in GROUPS)


def entries_of(spec: type) -> tuple[Entry, ...]:
    """Return the entries of installed packages whose specification is this class; () if simscen ships the class."""
    package = spec.__module__.partition(".")[0]
    if package == "simscen":
        return ()
    same_package = [
        entry
        for entry in _installed_entries()
        if not entry.problem and entry.value.partition(".")[0].partition(":")[0] == package
    ]
    return tuple(entry for entry in same_package if _has_spec(entry, spec))


def _has_spec(entry: Entry, spec: type) -> bool:
    try:
        return entry.load() is spec
    except BrokenPlugin:
        return False


@cache
def _installed_entries() -> tuple[Entry, ...]:
    """Return all entry points in groups of simscen, sorted by group, name, and package."""
    found = sorted(set(_read_entries()), key=lambda e: (e.group, e.name, e.distribution, e.version, e.value))
    return tuple(replace(entry, problem=entry.problem or _entry_problem(entry, found)) for entry in found)


def _read_entries() -> Iterator[Entry]:
    """Yield the entry points of all importable packages; for several with the same name, only those of the first."""
    from importlib.metadata import distributions

    seen: set[str] = set()
    for package in distributions(path=search_path()):
        if not _mentions_simscen(package):  # reading its name and the rest would take ten times longer
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
            yield Entry("", "", "entry_points.txt", *owner, f"its entry_points.txt is damaged: {error}", folder)
            continue
        for group, point, value in points:
            if group.startswith(PREFIX):
                yield Entry(group.removeprefix(PREFIX), point, value, *owner, folder=folder)


def _mentions_simscen(package: Distribution) -> bool:
    """Return whether a package can have entry points for simscen, even if its file is not valid UTF-8."""
    try:
        return PREFIX in (package.read_text("entry_points.txt") or "")
    except UnicodeDecodeError as error:
        return PREFIX.encode() in error.object


def search_path() -> list[str]:
    """Return the search path of modules without the two folders that Python adds by itself.

    These are the working directory and the folder of the program. Without them, a dist-info folder next to scenarios
    cannot run code.
    """
    program = getattr(sys.modules.get("__main__"), "__file__", None)
    implicit = {"", str(Path.cwd()), *([str(Path(program).absolute().parent)] if program else [])}
    python_path = os.environ.get("PYTHONPATH", "").split(os.pathsep)
    explicit = {str(Path(folder).absolute()) for folder in python_path if folder}
    return [folder for folder in sys.path if folder not in implicit - explicit]


def _entry_problem(entry: Entry, all_entries: list[Entry]) -> str:
    """Return why an entry cannot be used, as far as it is known without an import; "" if there is no reason."""
    group = GROUPS.get(entry.group)
    if group is None:
        return f"there is no group `{PREFIX}{entry.group}`"
    if not _NAME.fullmatch(entry.name):
        return "its name must start with a lowercase letter and consist of lowercase letters, digits, and `_`"
    if entry.name in group.reserved:
        return f"the name `{entry.name}` is reserved"
    if any(own.name == entry.name for own in shipped(entry.group)):
        return "simscen ships a type with the same name, which takes precedence"
    others = [other for other in all_entries if (other.group, other.name) == (entry.group, entry.name)]
    if len(others) > 1:
        return "added by " + " and by ".join(f"{other.origin} ({other.value})" for other in others)
    if not _ADDRESS.fullmatch(entry.value):
        return f"`{entry.value}` is not of the form package.module:Class"
    return ""


@cache
def _load(entry: Entry) -> type[BaseModel]:
    module, _, name = entry.value.partition(":")
    try:
        # Output of a module during import must not get into output that programs read.
        with contextlib.redirect_stdout(sys.stderr):
            model = getattr(import_module(module), name, None)
        if (why := _specification_problem(entry, model)) is None:
            model.model_rebuild()  # type: ignore[union-attr]
    except (Exception, SystemExit) as error:  # code of other packages can raise anything
        cause = f"{type(error).__name__}: {error}".splitlines()[0]
        hint = f"`{sys.executable} -c 'import {module}'` shows the traceback"
        raise BrokenPlugin(entry, f"`{entry.value}` cannot be loaded: {cause}", hint) from error
    if why is not None:
        raise BrokenPlugin(entry, why)
    return model  # type: ignore[return-value]


def _specification_problem(entry: Entry, model: Any) -> str | None:
    """Return why an imported object is not a valid specification of its group, or None."""
    if model is None:
        return f"`{entry.value}` does not exist"
    if not isinstance(model, type) or not issubclass(model, tuple(map(_resolve, _BASE_CLASSES))):
        return f"`{entry.value}` is not a subclass of simscen.plugin.Spec or simscen.plugin.Value"
    base = _resolve(GROUPS[entry.group].base)
    if not issubclass(model, base):
        return f"`{entry.value}` is not a subclass of simscen.plugin.{base.__name__}"
    if inspect.isabstract(model):
        missing = ", ".join(sorted(getattr(model, "__abstractmethods__", ())))
        return f"`{entry.value}` does not implement {missing}"
    problem = model.definition_problem() if hasattr(model, "definition_problem") else ""
    return f"`{entry.value}`: {problem}" if problem else None


def _resolve(address: str) -> Any:
    module, _, name = address.partition(":")
    return getattr(import_module(module), name)
