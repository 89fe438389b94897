"""The events and faults of a scenario as it orders them, with their triggers as they are written."""

from collections.abc import Iterator

import yaml

from simscen.core.disturbance import Disturbance
from simscen.loading.loaded import LoadedScenario
from simscen.loading.tree import Key, at


def disturbances_of(loaded: LoadedScenario) -> tuple[Disturbance, ...]:
    """Events, each with the steps of its story after it, then faults, in the order of the scenario."""
    return (*_events(loaded), *_faults(loaded))


def _events(loaded: LoadedScenario) -> Iterator[Disturbance]:
    for step in loaded.spec.steps:
        when = "" if step.when is None else _written(loaded, *step.keys, "when")
        yield Disturbance(step.name, "event", when, step.required, _line(loaded, *step.keys), step.after)


def _faults(loaded: LoadedScenario) -> Iterator[Disturbance]:
    for index, entry in enumerate(loaded.spec.faults):
        keys = ("faults", index)
        when = "" if entry.when is None else _written(loaded, *keys, "when")
        yield Disturbance(entry.label, "fault", when, entry.required, _line(loaded, *keys))


def _written(loaded: LoadedScenario, *keys: Key) -> str:
    """A mapping on one line as an author would write it, without its braces."""
    text = yaml.safe_dump(
        at(loaded.tree, keys).plain, default_flow_style=True, sort_keys=False, allow_unicode=True, width=10**9
    )
    return text.strip().removeprefix("{").removesuffix("}")


def _line(loaded: LoadedScenario, *keys: Key) -> int:
    """0 for what a base file holds: the line would be taken for one of the scenario's own."""
    place = loaded.place_of(*keys)
    return place.line if place.path == loaded.path else 0
