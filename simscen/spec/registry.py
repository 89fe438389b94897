"""What there is to choose from by name: what simscen ships, then what installed packages add to it.

A package adds a type by an entry point of a group `simscen.<kind>` whose value names a specification:

    [project.entry-points."simscen.criterion"]
    headway = "my_package.headway:Headway"

Shipped types are entries, too, written in the list of their room; both are found and loaded by what stands here. To
look for what is installed costs 30 ms (importlib.metadata), so it is done once, and only when a file uses a name that
is not shipped or somebody asks for everything. Nothing of a package is imported before a file uses what it adds.
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
_SPECIFICATIONS = ("simscen.spec.base:Spec", "simscen.spec.base:Value")
_NAME = re.compile(r"[a-z][a-z0-9_]{0,59}")
_VALUE = re.compile(r"(?P<module>[\w.]+):(?P<name>\w+)")


@dataclass(frozen=True)
class Group:
    """One kind of thing that packages may add to.

    `promise` is the class that every specification of the group must be a subclass of. `shipped` is where its list
    stands: a Choice, or a mapping of names to "module:Class". `reserved` are names that mean something else there.
    """

    promise: str
    shipped: str = ""
    reserved: tuple[str, ...] = ()


GROUPS: dict[str, Group] = {
    "stack": Group("simscen.model.stack:InProcessStack", "simscen.model.stack:STACKS", ("external",)),
    "localizer": Group("simscen.model.localizers:LocalizerSpec", "simscen.model.localizers:LOCALIZERS"),
    "planner": Group("simscen.model.planners:PlannerSpec", "simscen.model.planners:PLANNERS"),
    "controller": Group("simscen.model.controllers:ControllerSpec", "simscen.model.controllers:CONTROLLERS"),
    "behavior": Group("simscen.model.recovery:BehaviorSpec", "simscen.model.recovery:BEHAVIORS"),
    "goal_checker": Group("simscen.model.checkers:GoalCheckerSpec", "simscen.model.checkers:GOAL_CHECKERS"),
    "criterion": Group(
        "simscen.criteria.base:Criterion", "simscen.criteria.registry:AnyCriterion", ("id", "severity", "then")
    ),
    "fault": Group(
        "simscen.faults.base:Fault", "simscen.faults.registry:AnyFault", ("sensor", "when", "for", "name", "required")
    ),
    "trigger": Group(
        "simscen.triggers.base:Condition",
        "simscen.triggers.registry:AnyCondition",
        ("for", "robot", "edge", "delay", "times", "probability", "all", "any", "not"),
    ),
    "action": Group("simscen.actions.base:Action", "simscen.actions.registry:AnyAction", ("robot",)),
    "sensor": Group("simscen.model.robot:SensorSpec", "simscen.model.robot:Sensor"),
    "metric": Group("simscen.criteria.plugin_metric:Measure", "simscen.judge.metrics.catalog:ADDRESSES", ("metrics",)),
}
"""Kind → what is known of its group `simscen.<kind>`, in the order of the language."""


@dataclass(frozen=True)
class Entry:
    """A name in a group and the specification that it stands for, `value` = "package.module:Class".

    `distribution` and `version` are those of the package that adds it; "" for what is shipped. `flaw` says why it
    cannot be used, as far as that is known without importing it.
    """

    group: str
    name: str
    value: str
    distribution: str = ""
    version: str = ""
    flaw: str = ""
    folder: str = ""
    """Where its package is installed: a folder of the search path."""

    @property
    def shipped(self) -> bool:
        """Whether it comes with simscen."""
        return not self.distribution

    @property
    def origin(self) -> str:
        """Who adds it, for a message: "headway 1.2", with no version where its package has none."""
        return f"{self.distribution} {self.version}".strip() or "simscen"

    def load(self) -> type[BaseModel]:
        """Its specification; the module is imported now. Raises BrokenPlugin."""
        if self.flaw:
            raise BrokenPlugin(self, self.flaw)
        return _loaded(self)


class BrokenPlugin(Exception):
    """What an installed package adds cannot be used: `entry`, `why`, and a `hint` how to find out more."""

    def __init__(self, entry: Entry, why: str, hint: str = "") -> None:
        self.entry, self.why = entry, why
        self.hint = hint or "`simscen plugins` lists what installed packages add"
        super().__init__(f"{entry.group} `{entry.name}` of {entry.origin} cannot be used: {why}")


def shipped(group: str) -> tuple[Entry, ...]:
    """What simscen itself offers, in the order of its list."""
    where = GROUPS[group].shipped
    if not where:
        return ()
    listed = _resolved(where)
    values: dict[str, str] = listed if isinstance(listed, dict) else listed.addresses()
    return tuple(Entry(group, name, value) for name, value in values.items())


def installed(group: str) -> tuple[Entry, ...]:
    """What installed packages add, by name; those with a flaw, too, so that a file that uses one is told of it."""
    return tuple(entry for entry in _scanned() if entry.group == group)


def entries(group: str) -> tuple[Entry, ...]:
    """All of a group: what is shipped in the order of its list, then what is installed under other names."""
    own = shipped(group)
    names = {entry.name for entry in own}
    return (*own, *(entry for entry in installed(group) if entry.name not in names))


def find(group: str, name: str) -> Entry | None:
    """What a name of a group stands for. Packages are looked through only when nothing shipped is called so."""
    own = next((entry for entry in shipped(group) if entry.name == name), None)
    return own or next((entry for entry in installed(group) if entry.name == name), None)


def unknown_groups() -> tuple[Entry, ...]:
    """Entry points in groups `simscen.…` that there are not, each with its flaw: a slip of the pen in a package."""
    return tuple(entry for entry in _scanned() if entry.group not in GROUPS)


def origin_of(spec: type) -> tuple[Entry, ...]:
    """The entries of installed packages that stand for a specification; () for what is shipped."""
    package = spec.__module__.partition(".")[0]
    if package == "simscen":
        return ()
    near = [
        entry for entry in _scanned() if not entry.flaw and entry.value.partition(".")[0].partition(":")[0] == package
    ]
    return tuple(entry for entry in near if _is(entry, spec))


def _is(entry: Entry, spec: type) -> bool:
    try:
        return entry.load() is spec
    except BrokenPlugin:
        return False


@cache
def _scanned() -> tuple[Entry, ...]:
    """Every entry point of a group of ours, group by group, by name, then by distribution."""
    found = sorted(set(_read()), key=lambda e: (e.group, e.name, e.distribution, e.version, e.value))
    return tuple(replace(entry, flaw=entry.flaw or _flaw(entry, found)) for entry in found)


def _read() -> Iterator[Entry]:
    """The entry points of ours of every package that can be imported; of two packages of a name those of the first."""
    from importlib.metadata import distributions

    seen: set[str] = set()
    for package in distributions(path=search_path()):
        if not _is_about_us(package):  # to read what else there is of it, its name too, would cost ten times as much
            continue
        name, version = package.metadata["Name"], package.metadata["Version"] or ""
        key = re.sub("[-_.]+", "-", name or "").lower()
        if key and key in seen:
            continue
        seen.add(key)
        whose = (name or "an unnamed package", version)  # an installation that broke off has no METADATA
        folder = str(package.locate_file(""))
        try:
            points = [(point.group, point.name, point.value) for point in package.entry_points]
        except (ValueError, TypeError, LookupError) as error:  # what importlib.metadata raises on what is none
            yield Entry("", "", "entry_points.txt", *whose, f"its entry_points.txt is damaged: {error}", folder)
            continue
        for group, point, value in points:
            if group.startswith(PREFIX):
                yield Entry(group.removeprefix(PREFIX), point, value, *whose, folder=folder)


def _is_about_us(package: Distribution) -> bool:
    """Whether it may have entry points for simscen; damage to others is no concern of ours."""
    try:
        return PREFIX in (package.read_text("entry_points.txt") or "")
    except UnicodeDecodeError as error:
        return PREFIX.encode() in error.object


def search_path() -> list[str]:
    """Where Python looks for modules, without the folders that it adds by itself for where and how it was called.

    These are the working directory and that of the program: a folder of scenarios with a dist-info would be code.
    """
    program = getattr(sys.modules.get("__main__"), "__file__", None)
    implied = {"", str(Path.cwd()), *([str(Path(program).absolute().parent)] if program else [])}
    said = os.environ.get("PYTHONPATH", "").split(os.pathsep)
    wanted = {str(Path(folder).absolute()) for folder in said if folder}
    return [folder for folder in sys.path if folder not in implied - wanted]


def _flaw(entry: Entry, everything: list[Entry]) -> str:
    """What is wrong with it before anything is imported."""
    group = GROUPS.get(entry.group)
    if group is None:
        return f"there is no group `{PREFIX}{entry.group}`"
    if not _NAME.fullmatch(entry.name):
        return "a name is a small letter, then small letters, digits and `_`"
    if entry.name in group.reserved:
        return f"`{entry.name}` means something else there"
    if any(own.name == entry.name for own in shipped(entry.group)):
        return "simscen itself has one of that name, which is the one that files mean"
    others = [other for other in everything if (other.group, other.name) == (entry.group, entry.name)]
    if len(others) > 1:
        return "added by " + " and by ".join(f"{other.origin} ({other.value})" for other in others)
    if not _VALUE.fullmatch(entry.value):
        return f"`{entry.value}` is not of the form package.module:Class"
    return ""


@cache
def _loaded(entry: Entry) -> type[BaseModel]:
    module, _, name = entry.value.partition(":")
    try:
        # What a module prints while it is imported must not get into output that programs read.
        with contextlib.redirect_stdout(sys.stderr):
            model = getattr(import_module(module), name, None)
        if (why := _unfit(entry, model)) is None:
            model.model_rebuild()  # type: ignore[union-attr]
    except (Exception, SystemExit) as error:  # the boundary to code of others, which can raise anything
        told = f"{type(error).__name__}: {error}".splitlines()[0]
        hint = f"`{sys.executable} -c 'import {module}'` shows where"
        raise BrokenPlugin(entry, f"`{entry.value}` cannot be loaded: {told}", hint) from error
    if why is not None:
        raise BrokenPlugin(entry, why)
    return model  # type: ignore[return-value]


def _unfit(entry: Entry, model: Any) -> str | None:
    """Why it is no specification of its group."""
    if model is None:
        return f"`{entry.value}` is not there"
    if not isinstance(model, type) or not issubclass(model, tuple(map(_resolved, _SPECIFICATIONS))):
        return f"`{entry.value}` is no specification: neither a simscen.spec.base.Spec nor a Value"
    promise = _resolved(GROUPS[entry.group].promise)
    if not issubclass(model, promise):
        return f"`{entry.value}` is no simscen.plugin.{promise.__name__}"
    if inspect.isabstract(model):
        missing = ", ".join(sorted(getattr(model, "__abstractmethods__", ())))
        return f"`{entry.value}` does not say what it does: {missing} is missing"
    broken = model.broken_promise() if hasattr(model, "broken_promise") else ""
    return f"`{entry.value}`: {broken}" if broken else None


def _resolved(address: str) -> Any:
    module, _, name = address.partition(":")
    return getattr(import_module(module), name)
