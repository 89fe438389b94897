"""Which installed packages a scenario uses, and what of them."""

from collections.abc import Container, Iterable, Iterator, Mapping
from typing import Any

from simscen.core.errors import Problem
from simscen.loading.loaded import LoadedScenario
from simscen.loading.spec_walk import Keys, walk
from simscen.spec.choice import Choice
from simscen.spec.registry import Entry, find, origin_of

_FACT = "plugin."


def plugins_of(loaded: LoadedScenario) -> tuple[Entry, ...]:
    """What the scenario and its robots take from installed packages, sorted."""
    return used_by(loaded.spec, *(view.robot.spec for view in loaded.each.values()))


def plugins_of_all(scenarios: Iterable[LoadedScenario]) -> tuple[Entry, ...]:
    """What any of the scenarios takes from installed packages, sorted; each scenario is looked at once."""
    different = {id(scenario): scenario for scenario in scenarios}.values()
    return _sorted({entry for scenario in different for entry in plugins_of(scenario)})


def used_by(*specs: Any) -> tuple[Entry, ...]:
    """What validated specifications take from installed packages, sorted."""
    found = {entry for spec in specs for keys, part in walk(spec) for entry in _used(keys, part)}
    return _sorted(found)


def fact_of(entry: Entry) -> str:
    """What the log's header calls it."""
    return f"{_FACT}{entry.group}.{entry.name}"


def requirement_of(entry: Entry) -> str:
    """Its package and version as pip writes them."""
    return f"{entry.distribution}=={entry.version}"


def missing_plugins(facts: Mapping[str, str], kinds: Container[str]) -> list[Problem]:
    """What of these kinds a log was made with, by its header's `facts`, and is not installed as it was then."""
    missing = []
    for fact, then in sorted(facts.items()):
        kind, _, name = fact.removeprefix(_FACT).partition(".")
        if not fact.startswith(_FACT) or kind not in kinds:
            continue
        entry = find(kind, name)
        now = requirement_of(entry) if entry is not None else ""
        if now != then:
            instead = f"installed is {now}" if now else "it is not installed"
            message = f"the run was judged with {kind} `{name}` of {then}, and {instead}"
            missing.append((message, f"`pip install {then}`, or judge by another file with --scenario"))
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
