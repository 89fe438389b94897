"""Search for the plug-in types that a scenario uses, and for plug-in types of a log that are not installed."""

from collections.abc import Container, Iterable, Iterator, Mapping
from typing import Any

from simscen.core.errors import Problem
from simscen.loading.loaded import LoadedScenario
from simscen.loading.spec_walk import walk
from simscen.loading.yaml.tree import Keys
from simscen.spec.choice import Choice
from simscen.spec.registry import RegisteredType, find_type, plugins_with_spec

_HEADER_PREFIX = "plugin."
"""Beginning of the header keys of plug-ins in a log."""


def plugins_of(loaded: LoadedScenario) -> tuple[RegisteredType, ...]:
    """Return the types of plug-ins that a scenario and its robots use, sorted by group and name."""
    robots = [view.robot.spec for view in loaded.robot_views.values()]
    specs = [loaded.spec, *(robot for robot in robots if robot is not None)]  # None for a URDF alone
    return _sorted({entry for spec in specs for keys, part in walk(spec) for entry in _plugin_types(keys, part)})


def plugins_of_all(scenarios: Iterable[LoadedScenario]) -> tuple[RegisteredType, ...]:
    """Return the types of plug-ins that at least one of the scenarios uses, sorted by group and name."""
    distinct = {id(scenario): scenario for scenario in scenarios}.values()
    return _sorted({entry for scenario in distinct for entry in plugins_of(scenario)})


def log_header_key(entry: RegisteredType) -> str:
    """Return the key of a type in a log header, e.g. `plugin.criterion.dwell`. The value is from `requirement_of`."""
    return f"{_HEADER_PREFIX}{entry.group}.{entry.name}"


def requirement_of(entry: RegisteredType) -> str:
    """Return the pip requirement for the package that adds a type: `package==version`."""
    return f"{entry.distribution}=={entry.version}"


def missing_plugins(facts: Mapping[str, str], groups: Container[str]) -> list[Problem]:
    """Return a problem for each plug-in type of a log that is not installed in the recorded version.

    `facts` are the header entries of the log. Only types of the registry groups `groups` count. The path of the
    problems is "".
    """
    missing: list[Problem] = []
    for key, recorded in sorted(facts.items()):
        group, _, name = key.removeprefix(_HEADER_PREFIX).partition(".")
        if not key.startswith(_HEADER_PREFIX) or group not in groups:
            continue
        entry = find_type(group, name)
        installed = requirement_of(entry) if entry is not None else ""
        if installed != recorded:
            difference = f"{installed} is installed" if installed else "it is not installed"
            message = f"the run was judged with {group} `{name}` of {recorded}, but {difference}"
            hint = f"`pip install {recorded}`, or judge with another file: --scenario"
            missing.append(Problem("", 0, 0, "SC805", message, hint))
    return missing


def _sorted(entries: Iterable[RegisteredType]) -> tuple[RegisteredType, ...]:
    return tuple(sorted(entries, key=lambda entry: (entry.group, entry.name)))


def _plugin_types(keys: Keys, part: Any) -> Iterator[RegisteredType]:
    """Yield the plug-in types whose specification is `part`. `keys` are the keys of `part`.

    If a package registers the class of `part` under several names, the `type` or the last key of `part` decides.
    """
    if isinstance(part, Choice):
        entry = find_type(part.group, part.kind) if part.original_class is not None else None
        if entry is not None and not entry.is_shipped:
            yield entry
        return
    candidates = plugins_with_spec(type(part))
    named = [entry for entry in candidates if entry.name in (getattr(part, "type", None), *keys[-1:])]
    yield from named or candidates[:1]
