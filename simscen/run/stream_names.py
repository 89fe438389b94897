"""Names of the random streams of events and faults. A change of one entry does not affect the streams of others."""

import json
from collections import Counter
from collections.abc import Sequence
from typing import Any

from pydantic import BaseModel, RootModel

from simscen.loading.spec_walk import walk
from simscen.model.disturbances import EventEntry, FaultEntry, StepEntry
from simscen.spec.choice import Choice


def stream_names(entries: Sequence[EventEntry | StepEntry | FaultEntry]) -> list[str]:
    """Return the name of the random stream of each entry.

    The stream of an entry with a `name` has this name. Any other stream is named after the content of its entry.
    Entries with equal names or contents are numbered.
    """
    contents = [f"/{entry.name}" if entry.name is not None else f"={_content_key(entry)}" for entry in entries]
    counts: Counter[str] = Counter()
    names = []
    for content in contents:
        counts[content] += 1
        names.append(f"{content}#{counts[content]}")
    return names


def _content_key(entry: BaseModel) -> str:
    """Return the content of an entry as JSON, without defaults."""
    if any(isinstance(part, Choice) and part.original_class is not None for _, part in walk(entry)):
        return json.dumps(_plain(entry), sort_keys=True)
    _build_serializers(entry)
    return entry.model_dump_json(exclude_defaults=True)


def _plain(value: Any) -> Any:
    """Return the content of a specification as plain data, without defaults. Unlike pydantic, includes plug-ins."""
    if isinstance(value, RootModel):
        return _plain(value.root)
    if isinstance(value, BaseModel):
        fields = {
            name: field.get_default(call_default_factory=True) for name, field in type(value).model_fields.items()
        }
        return {name: _plain(current) for name, current in value if current != fields[name]}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    return value if isinstance(value, str | int | float | None) else str(value)


def _build_serializers(value: object) -> None:
    """Build the serializers of all nested models, which pydantic 2.11 does not do for unpickled models."""
    if isinstance(value, BaseModel):
        type(value).model_rebuild()
        for _, inner in value:
            _build_serializers(inner)
    elif isinstance(value, list):
        for inner in value:
            _build_serializers(inner)
