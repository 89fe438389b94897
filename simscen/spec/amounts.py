"""Numbers of whatever dimension, with the unit that they are written with."""

import math
from dataclasses import dataclass
from typing import Annotated, Any, NamedTuple

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from simscen.spec.quantities import NUMBER_AND_UNIT, UNITS


class Amount(NamedTuple):
    """A number and the unit behind it; "" = a bare number."""

    number: float
    unit: str = ""


@dataclass(frozen=True)
class _OfAnyDimension:
    """Marks a number whose dimension is that of the place where it goes."""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_plain_validator_function(_parse)

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        return {"type": ["number", "string"], "description": "a number, with its unit if it has one"}


AnyAmount = Annotated[Amount, _OfAnyDimension()]


def together(amounts: tuple[Amount, ...]) -> tuple[tuple[float, ...], str]:
    """The numbers in one unit, and that unit: their own where it is the same, else SI.

    Raises ValueError where they have no dimension in common.
    """
    units = {amount.unit for amount in amounts}
    if len(units) == 1:
        return tuple(amount.number for amount in amounts), units.pop()
    for known in UNITS.values():
        if units <= {"", *known}:
            return tuple(amount.number * known.get(amount.unit, 1.0) for amount in amounts), ""
    told = " and ".join(f"`{unit}`" for unit in sorted(units - {""}))
    raise ValueError(f"{told} are no units of one dimension")


def _parse(value: Any) -> Amount:
    if isinstance(value, int | float) and not isinstance(value, bool):
        if not math.isfinite(value):
            raise PydanticCustomError("finite_number", "must be a finite number")
        return Amount(float(value))
    match = NUMBER_AND_UNIT.fullmatch(value) if isinstance(value, str) else None
    if match and any(match[2] in known for known in UNITS.values()) and math.isfinite(float(match[1])):
        return Amount(float(match[1]), match[2])
    told = f"the text `{value}`" if isinstance(value, str) else "something else"
    raise PydanticCustomError(
        "amount", "{problem}", {"problem": f"expected a number with or without a unit, got {told}"}
    )
