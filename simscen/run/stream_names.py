"""Name the random stream of each event and fault so that a change of one entry does not affect the others."""

import json
from collections import Counter
from collections.abc import Sequence
from typing import Any

from pydantic import BaseModel, RootModel

from simscen.loading.spec_walk import walk
from simscen.model.disturbances import EventEntry, FaultEntry, StepEntry
from simscen.spec.choice import Choice


def stream_names(entries: Sequence[EventEntry | StepEntry | FaultEntry]) -> list[str]:
    """Return the name of the random stream of each entry; it does not depend on other entries or on the order.

    The stream of an entry with a `name` has this name, and stays the same if the entry is edited. The stream of another
    entry is named after its content. Entries with equal names or contents are numbered.
    """
    contents = [f"/{entry.name}" if entry.name is not None else f"={_content_key(entry)}" for entry in entries]
    counts: Counter[str] = Counter()
    names = []
    for content in contents:
        counts[content] += 1
        names.append(f"{content}#{counts[content]}")
    return names


def _content_key(entry: BaseModel) -> str:
    if any(isinstance(part, Choice) and part.original_class is not None for _, part in walk(entry)):
        return json.dumps(_plain(entry), sort_keys=True)
    _build_serializers(entry)
    return entry.model_dump_json(exclude_defaults=True)


def _plain(value: Any) -> Any:
    """Return the content of a specification as plain data, without defaults.

    pydantic would serialize only the fields of the declared class, and a choice from an installed package is an
    instance of another class.
    """
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
    """Build the serializers of all nested models, because pydantic 2.11 does not do so for unpickled models."""
    if isinstance(value, BaseModel):
        type(value).model_rebuild()
        for _, inner in value:
            _build_serializers(inner)
    elif isinstance(value, list):
        for inner in value:
            _build_serializers(inner)
