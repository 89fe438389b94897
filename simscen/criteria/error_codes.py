"""Nav2's error codes as values of YAML keys, and as data of recorded events."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import GetJsonSchemaHandler, PlainValidator
from pydantic_core import CoreSchema, PydanticCustomError

from simscen.core.messages.navigation import ErrorCode, error_code
from simscen.core.records.events import Event
from simscen.spec.base import Spec


def parse_error_code(value: Any) -> ErrorCode:
    """Return the error code with a name or number, e.g. GOAL_OCCUPIED or 206. Raises PydanticCustomError if unknown."""
    if isinstance(value, ErrorCode):
        return value
    if isinstance(value, str) and value in ErrorCode.__members__:
        return ErrorCode[value]
    if isinstance(value, int) and not isinstance(value, bool):
        code = error_code(value)
        if isinstance(code, ErrorCode):
            return code
    raise PydanticCustomError(
        "error_code",
        "unknown error code `{value}`; expected one of: {names}",
        {"value": str(value), "names": ", ".join(ErrorCode.__members__)},
    )


class _ErrorCodeSchema:
    """Adds the JSON schema of an error code: one of the names or numbers."""

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        return {"enum": [*ErrorCode.__members__, *(int(code) for code in ErrorCode)]}


ErrorCodeValue = Annotated[ErrorCode, PlainValidator(parse_error_code), _ErrorCodeSchema()]
"""Type of the value of a YAML key: the name or number of an error code."""


def error_code_name(event: Event) -> str:
    """Return the name of the error code of an event; "NONE" if the event has no error code.

    If ErrorCode does not contain the code, return the number of the code as text.
    """
    name, number = event.data.get("error_name"), event.data.get("error_code")
    if isinstance(name, str) and name:
        return name
    code = error_code(number) if isinstance(number, int) else None
    if isinstance(code, ErrorCode):
        return code.name
    return ErrorCode.NONE.name if number is None else str(number)


def has_error_code(event: Event) -> bool:
    """Return whether an event has an error code. Events in logs of real robots have none."""
    return not event.data.keys().isdisjoint(("error_name", "error_code"))


class ExpectedError(Spec):
    """Error code with which a goal is expected to fail.

    Example: `expect: {error_code: GOAL_OCCUPIED}`
    """

    error_code: ErrorCodeValue
    """Error code of Nav2, by name or number."""
