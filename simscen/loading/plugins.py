"""Find which plugins of installed packages a scenario uses, and check that the plugins of a log are installed.

An Entry is one plugin, i.e. an entry point of an installed package.
"""

from collections.abc import Container, Iterable, Iterator, Mapping
from typing import Any

from simscen.core.errors import Problem
from simscen.loading.loaded import LoadedScenario
from simscen.loading.spec_walk import walk
from simscen.loading.yaml.tree import Keys
from simscen.spec.choice import Choice
from simscen.spec.registry import Entry, entries_of, find

_HEADER_PREFIX = "plugin."
"""Beginning of the keys of plugins in the header of a log."""


def plugins_of(loaded: LoadedScenario) -> tuple[Entry, ...]:
    """Return the plugins that a scenario and its robots use, sorted."""
    return used_by(loaded.spec, *(view.robot.spec for view in loaded.robot_views.values()))


def plugins_of_all(scenarios: Iterable[LoadedScenario]) -> tuple[Entry, ...]:
    """Return the plugins that at least one of the scenarios uses, sorted."""
    different = {id(scenario): scenario for scenario in scenarios}.values()
    return _sorted({entry for scenario in different for entry in plugins_of(scenario)})


def used_by(*specs: Any) -> tuple[Entry, ...]:
    """Return the plugins that specifications use, sorted."""
    found = {entry for spec in specs for keys, part in walk(spec) for entry in _used(keys, part)}
    return _sorted(found)


def log_header_key(entry: Entry) -> str:
    """Return the key under which the header of a log records the version of a plugin: `plugin.criterion.dwell`."""
    return f"{_HEADER_PREFIX}{entry.group}.{entry.name}"


def requirement_of(entry: Entry) -> str:
    """Return the requirement by which pip installs the package of a plugin in its version: `package==version`."""
    return f"{entry.distribution}=={entry.version}"


def missing_plugins(header: Mapping[str, str], groups: Container[str]) -> list[Problem]:
    """Return a problem for each plugin that a log used, but that is not installed in the same version.

    `header` is the header of the log. Only plugins of these `groups`, e.g. "criterion", are checked. The problems have
    no path; the caller adds it.
    """
    missing: list[Problem] = []
    for key, recorded in sorted(header.items()):
        group, _, name = key.removeprefix(_HEADER_PREFIX).partition(".")
        if not key.startswith(_HEADER_PREFIX) or group not in groups:
            continue
        entry = find(group, name)
        installed = requirement_of(entry) if entry is not None else ""
        if installed != recorded:
            difference = f"{installed} is installed" if installed else "it is not installed"
            message = f"the run was judged with {group} `{name}` of {recorded}, but {difference}"
            hint = f"`pip install {recorded}`, or judge with another file: --scenario"
            missing.append(Problem("", 0, 0, "SC805", message, hint))
    return missing


def _sorted(entries: Iterable[Entry]) -> tuple[Entry, ...]:
    return tuple(sorted(entries, key=lambda entry: (entry.group, entry.name)))


def _used(keys: Keys, part: Any) -> Iterator[Entry]:
    """Yield the plugin that defines a part of a specification, if one does; `keys` are those of the part."""
    if isinstance(part, Choice):
        entry = find(part.group, part.kind) if part.original_class is not None else None
        if entry is not None and not entry.is_shipped:
            yield entry
        return
    candidates = entries_of(type(part))
    named = [entry for entry in candidates if entry.name in (getattr(part, "type", None), *keys[-1:])]
    yield from named or candidates[:1]
