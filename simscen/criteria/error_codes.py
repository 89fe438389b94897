"""Nav2's error codes as a user writes them: by name or by number."""

from typing import Annotated, Any

from pydantic import GetJsonSchemaHandler, PlainValidator
from pydantic_core import CoreSchema, PydanticCustomError

from simscen.core.messages.navigation import ErrorCode, error_code
from simscen.core.records.events import Event


def parse(value: Any) -> ErrorCode:
    """GOAL_OCCUPIED or 206. Raises a validation error that lists the names."""
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


class _Documented:
    """The JSON Schema of a code: one of the names or one of the numbers."""

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        return {"enum": [*ErrorCode.__members__, *(int(code) for code in ErrorCode)]}


Code = Annotated[ErrorCode, PlainValidator(parse), _Documented()]


def code_of(event: Event) -> str:
    """The code an event carries, by name where Nav2 has one for it, else "NONE" or the number."""
    name, number = event.data.get("error_name"), event.data.get("error_code")
    if isinstance(name, str) and name:
        return name
    code = error_code(number) if isinstance(number, int) else None
    if isinstance(code, ErrorCode):
        return code.name
    return ErrorCode.NONE.name if number is None else str(number)
