"""Find the plugins of installed packages that a scenario uses."""

from collections.abc import Container, Iterable, Iterator, Mapping
from typing import Any

from simscen.core.errors import Problem
from simscen.loading.loaded import LoadedScenario
from simscen.loading.spec_walk import Keys, walk
from simscen.spec.choice import Choice
from simscen.spec.registry import Entry, find, origin_of

_FACT = "plugin."


def plugins_of(loaded: LoadedScenario) -> tuple[Entry, ...]:
    """Return the plugins that a scenario and its robots use, sorted."""
    return used_by(loaded.spec, *(view.robot.spec for view in loaded.each.values()))


def plugins_of_all(scenarios: Iterable[LoadedScenario]) -> tuple[Entry, ...]:
    """Return the plugins that any of the scenarios uses, sorted."""
    different = {id(scenario): scenario for scenario in scenarios}.values()
    return _sorted({entry for scenario in different for entry in plugins_of(scenario)})


def used_by(*specs: Any) -> tuple[Entry, ...]:
    """Return the plugins that validated specifications use, sorted."""
    found = {entry for spec in specs for keys, part in walk(spec) for entry in _used(keys, part)}
    return _sorted(found)


def fact_of(entry: Entry) -> str:
    """Return the name of a plugin in the header of a log."""
    return f"{_FACT}{entry.group}.{entry.name}"


def requirement_of(entry: Entry) -> str:
    """Return package and version of a plugin, as pip writes them."""
    return f"{entry.distribution}=={entry.version}"


def missing_plugins(facts: Mapping[str, str], kinds: Container[str]) -> list[Problem]:
    """Return problems with plugins of these kinds that a log was made with and that are not installed in that version.

    `facts` are those of the header of the log.
    """
    missing = []
    for fact, then in sorted(facts.items()):
        kind, _, name = fact.removeprefix(_FACT).partition(".")
        if not fact.startswith(_FACT) or kind not in kinds:
            continue
        entry = find(kind, name)
        now = requirement_of(entry) if entry is not None else ""
        if now != then:
            instead = f"{now} is installed" if now else "it is not installed"
            message = f"the run was judged with {kind} `{name}` of {then}, but {instead}"
            missing.append((message, f"`pip install {then}`, or judge with another file: --scenario"))
    return [Problem("", 0, 0, "SC805", message, hint) for message, hint in missing]


def _sorted(entries: Iterable[Entry]) -> tuple[Entry, ...]:
    return tuple(sorted(entries, key=lambda entry: (entry.group, entry.name)))


def _used(keys: Keys, part: Any) -> Iterator[Entry]:
    if isinstance(part, Choice):
        entry = find(part.group, part.kind) if part.narrow is not None else None
        if entry is not None and not entry.shipped:
            yield entry
        return
    candidates = origin_of(type(part))
    named = [entry for entry in candidates if entry.name in (getattr(part, "type", None), *keys[-1:])]
    yield from named or candidates[:1]
