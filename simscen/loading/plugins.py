"""Find the plugins of installed packages that a scenario uses."""

from collections.abc import Container, Iterable, Iterator, Mapping
from typing import Any

from simscen.core.errors import Problem
from simscen.loading.loaded import LoadedScenario
from simscen.loading.spec_walk import Keys, walk
from simscen.spec.choice import Choice
from simscen.spec.registry import Entry, find, origin_of

_HEADER_PREFIX = "plugin."


def plugins_of(loaded: LoadedScenario) -> tuple[Entry, ...]:
    """Return the plugins that a scenario and its robots use, sorted."""
    return used_by(loaded.spec, *(view.robot.spec for view in loaded.robot_views.values()))


def plugins_of_all(scenarios: Iterable[LoadedScenario]) -> tuple[Entry, ...]:
    """Return the plugins that at least one of the scenarios uses, sorted."""
    different = {id(scenario): scenario for scenario in scenarios}.values()
    return _sorted({entry for scenario in different for entry in plugins_of(scenario)})


def used_by(*specs: Any) -> tuple[Entry, ...]:
    """Return the plugins that validated specifications use, sorted."""
    found = {entry for spec in specs for keys, part in walk(spec) for entry in _used(keys, part)}
    return _sorted(found)


def fact_of(entry: Entry) -> str:
    """Return the key of a plugin in the header of a log."""
    return f"{_HEADER_PREFIX}{entry.group}.{entry.name}"


def requirement_of(entry: Entry) -> str:
    """Return package and version of a plugin, as pip writes them."""
    return f"{entry.distribution}=={entry.version}"


def missing_plugins(facts: Mapping[str, str], kinds: Container[str]) -> list[Problem]:
    """Return a problem for each plugin of these kinds that a log used and that is not installed in the same version.

    `facts` are the entries in the header of the log.
    """
    missing = []
    for fact, recorded in sorted(facts.items()):
        kind, _, name = fact.removeprefix(_HEADER_PREFIX).partition(".")
        if not fact.startswith(_HEADER_PREFIX) or kind not in kinds:
            continue
        entry = find(kind, name)
        installed = requirement_of(entry) if entry is not None else ""
        if installed != recorded:
            difference = f"{installed} is installed" if installed else "it is not installed"
            message = f"the run was judged with {kind} `{name}` of {recorded}, but {difference}"
            missing.append((message, f"`pip install {recorded}`, or judge with another file: --scenario"))
    return [Problem("", 0, 0, "SC805", message, hint) for message, hint in missing]


def _sorted(entries: Iterable[Entry]) -> tuple[Entry, ...]:
    return tuple(sorted(entries, key=lambda entry: (entry.group, entry.name)))


def _used(keys: Keys, part: Any) -> Iterator[Entry]:
    if isinstance(part, Choice):
        entry = find(part.group, part.kind) if part.original_class is not None else None
        if entry is not None and not entry.shipped:
            yield entry
        return
    candidates = origin_of(type(part))
    named = [entry for entry in candidates if entry.name in (getattr(part, "type", None), *keys[-1:])]
    yield from named or candidates[:1]
