"""scenery.json: the attachment of a log with what there was to see."""

from pydantic import TypeAdapter, ValidationError
from pydantic_core import to_json

from simscen.core.environment.scenery import Scenery
from simscen.record.header import LogHeader

NAME = "scenery.json"
_SCENERIES = TypeAdapter(Scenery)


def scenery_to_json(scenery: Scenery) -> bytes:
    """The scenery as strict JSON."""
    return to_json(scenery)


def scenery_of(about: LogHeader) -> Scenery:
    """What the log says there was to see; nothing where it is older than that. Raises ValueError when it is none."""
    data = about.files.get(NAME)
    if data is None:
        return Scenery()
    try:
        return _SCENERIES.validate_json(data)
    except ValidationError as error:
        raise ValueError(f"not a scenery: {error.errors(include_url=False)[0]['msg']}") from None
