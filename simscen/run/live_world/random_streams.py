"""What the random streams of events and faults are called: never by their place in a list."""

import json
from collections import Counter
from collections.abc import Sequence
from typing import Any

from pydantic import BaseModel, RootModel

from simscen.loading.spec_walk import walk
from simscen.model.disturbances import EventEntry, FaultEntry, StepEntry
from simscen.spec.choice import Choice


def stream_names(entries: Sequence[EventEntry | StepEntry | FaultEntry]) -> list[str]:
    """A name for the chance of each entry that neither other entries nor the order of the list can change.

    An entry with a name draws from the stream of its name, whatever else is edited in it. One without draws from the
    stream of what it says: editing it gives it other draws, and only it. Of entries that say the same the k-th draws
    from the k-th stream, so that it does not matter which is which.
    """
    said = [f"/{entry.name}" if entry.name is not None else f"={_written(entry)}" for entry in entries]
    before: Counter[str] = Counter()
    names = []
    for what in said:
        before[what] += 1
        names.append(f"{what}#{before[what]}")
    return names


def _written(entry: BaseModel) -> str:
    if any(isinstance(part, Choice) and part.narrow is not None for _, part in walk(entry)):
        return json.dumps(_plain(entry), sort_keys=True)
    _build(entry)
    return entry.model_dump_json(exclude_defaults=True)


def _plain(value: Any) -> Any:
    """What is written in a specification, without defaults.

    A choice of an installed package is an instance of a wider class than its field says, of which pydantic would write
    what the field knows alone.
    """
    if isinstance(value, RootModel):
        return _plain(value.root)
    if isinstance(value, BaseModel):
        fields = {
            name: field.get_default(call_default_factory=True) for name, field in type(value).model_fields.items()
        }
        return {name: _plain(given) for name, given in value if given != fields[name]}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    return value if isinstance(value, str | int | float | None) else str(value)


def _build(value: object) -> None:
    """Have the serializers of all models in it built: pydantic 2.11 does not, of models that came from a pickle."""
    if isinstance(value, BaseModel):
        type(value).model_rebuild()
        for _, inner in value:
            _build(inner)
    elif isinstance(value, list):
        for inner in value:
            _build(inner)
