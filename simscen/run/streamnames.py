"""What the random streams of events and faults are called: never by their place in a list."""

from collections import Counter
from collections.abc import Sequence

from pydantic import BaseModel

from simscen.model.disturbance import EventEntry, FaultEntry


def stream_names(entries: Sequence[EventEntry | FaultEntry]) -> list[str]:
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
    _build(entry)
    # As what they are, not as what the field says: a choice of an installed package is an instance of a wider class.
    return entry.model_dump_json(exclude_defaults=True, serialize_as_any=True)


def _build(value: object) -> None:
    """Have the serializers of all models in it built: pydantic 2.11 does not, of models that came from a pickle."""
    if isinstance(value, BaseModel):
        type(value).model_rebuild()
        for _, inner in value:
            _build(inner)
    elif isinstance(value, list):
        for inner in value:
            _build(inner)
