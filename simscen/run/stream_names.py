"""Names of the random streams (sequences of random numbers) of events and faults.

A stream is named after its event or fault. A change of one entry therefore does not affect the random numbers of other
entries, except of later entries with the same name or content.
"""

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

    The name of a stream contains the `name` of the entry, or the content of an entry without a name. A number
    distinguishes entries with the same name or content.
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
        return json.dumps(_to_plain_data(entry), sort_keys=True)
    _build_serializers(entry)
    return entry.model_dump_json(exclude_defaults=True)


def _to_plain_data(value: Any) -> Any:
    """Return a specification as plain data without defaults, including the specifications of plug-ins."""
    if isinstance(value, RootModel):
        return _to_plain_data(value.root)
    if isinstance(value, BaseModel):
        fields = {
            name: field.get_default(call_default_factory=True) for name, field in type(value).model_fields.items()
        }
        return {name: _to_plain_data(current) for name, current in value if current != fields[name]}
    if isinstance(value, list | tuple):
        return [_to_plain_data(item) for item in value]
    if isinstance(value, dict):
        return {str(key): _to_plain_data(item) for key, item in value.items()}
    return value if isinstance(value, str | int | float | None) else str(value)


def _build_serializers(value: object) -> None:
    """Build the serializers of a model and its nested models, because pydantic 2.11 omits them after unpickling."""
    if isinstance(value, BaseModel):
        type(value).model_rebuild()
        for _, inner in value:
            _build_serializers(inner)
    elif isinstance(value, list):
        for inner in value:
            _build_serializers(inner)
