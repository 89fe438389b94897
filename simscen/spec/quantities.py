"""Field types for physical quantities: a number in SI units, or text with a unit, such as "50 cm"."""

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Literal, NamedTuple

from pydantic import Field, GetCoreSchemaHandler, GetJsonSchemaHandler, PlainValidator, WithJsonSchema
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

_METERS = {"m": 1.0, "cm": 0.01, "mm": 0.001, "km": 1000.0}
"""Factors to meters, by unit."""
_SECONDS = {"s": 1.0, "ms": 0.001, "min": 60.0, "h": 3600.0}
"""Factors to seconds, by unit."""
_RADIANS = {"rad": 1.0, "deg": math.pi / 180}
"""Factors to radians, by unit."""
NUMBER_AND_UNIT_PATTERN = re.compile(
    r"\s*([-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?)\s*([^\s\d](?:.*\S)?)\s*"
)
"""Pattern of a quantity such as "1.5 m". Group 1 is the number, group 2 the unit."""
MAX_TEXT_CHARS = 60
"""Maximum number of characters of a text from a file that a message shows."""


def _units_per(
    numerators: dict[str, float], denominators: dict[str, float], power: Literal["", "^2"] = ""
) -> dict[str, float]:
    """Return the SI factors of all quotients of two units, e.g. of m/s^2 from m and s with the power "^2"."""
    return {
        f"{top}/{bottom}{power}": top_factor / (bottom_factor**2 if power else bottom_factor)
        for top, top_factor in numerators.items()
        for bottom, bottom_factor in denominators.items()
    }


UNITS: dict[str, dict[str, float]] = {
    "length": _METERS,
    "duration": _SECONDS,
    "angle": _RADIANS,
    "speed": _units_per(_METERS, {"s": 1.0, "h": 3600.0, "min": 60.0}),
    "angular speed": _units_per(_RADIANS, {"s": 1.0}),
    "acceleration": _units_per(_METERS, {"s": 1.0}, "^2"),
    "angular acceleration": _units_per(_RADIANS, {"s": 1.0}, "^2"),
    "jerk": {"m/s^3": 1.0},
    "mass": {"kg": 1.0, "g": 0.001, "t": 1000.0},
    "frequency": {"Hz": 1.0, "kHz": 1000.0},
    "force": {"N": 1.0, "kN": 1000.0},
    "impulse": {"N s": 1.0, "Ns": 1.0},
    "ratio": {"%": 0.01},
}
"""Factors to SI units, by dimension and unit."""


def with_article(noun: str) -> str:
    """Return a noun with its indefinite article, e.g. "an angle"."""
    return f"an {noun}" if noun[0] in "aeiou" else f"a {noun}"


@dataclass(frozen=True)
class Quantity:
    """Annotation of a float with a physical `dimension`, a key of UNITS. Validation converts text to SI units."""

    dimension: str

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return core_schema.no_info_before_validator_function(self.parse, handler(source))

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        number, units = dict(handler(schema)), list(UNITS[self.dimension])
        message = f"expected {with_article(self.dimension)}, e.g. 1.5 {units[0]}; units: {', '.join(units)}"
        # Bounds apply only to numbers and the pattern only to text, so both fit into one schema.
        return {
            **number,
            "type": [number["type"], "string"],
            "pattern": _json_schema_pattern(units),
            "description": f"{self.dimension}, e.g. 1.5 {units[0]}",
            "patternErrorMessage": message,
        }

    def parse(self, value: Any) -> Any:
        """Convert text such as "90 deg" to SI units; return other values unchanged. Raises PydanticCustomError."""
        if not isinstance(value, str):
            return value
        units = UNITS[self.dimension]
        match = NUMBER_AND_UNIT_PATTERN.fullmatch(value)
        if match and match[2] in units:
            return float(match[1]) * units[match[2]]
        other = next((name for name, others in UNITS.items() if match and match[2] in others), "")
        if match and other:
            problem = f"`{match[2]}` is a unit of {other}, but this is {with_article(self.dimension)}"
        elif match:
            problem = f"unknown unit `{match[2]}` for {with_article(self.dimension)}"
        else:
            problem = f"expected {with_article(self.dimension)}, got {_text(value)}"
        context = {"problem": problem, "units": ", ".join(units)}
        raise PydanticCustomError("quantity", "{problem}; units: {units}", context)


def _text(value: str) -> str:
    """Return a text from a file for messages, shortened to MAX_TEXT_CHARS."""
    return f"the text `{value if len(value) <= MAX_TEXT_CHARS else value[: MAX_TEXT_CHARS - 1] + '…'}`"


def _json_schema_pattern(units: Iterable[str]) -> str:
    """Return the pattern of a number with one of these units, which is also valid in JavaScript."""
    choices = "|".join(unit.replace("^", r"\^") for unit in dict.fromkeys(units))
    return rf"^\s*[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?\s*({choices})\s*$"


@dataclass(frozen=True)
class AnyQuantity:
    """Annotation of a float with a dimension that depends on another field. The JSON schema allows all units.

    The specification that contains the field must convert text to a number with `si_number`.
    """

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        return {
            **handler(schema),
            "type": ["number", "string"],
            "pattern": _json_schema_pattern(unit for units in UNITS.values() for unit in units),
            "patternErrorMessage": "expected a number with a unit, such as 1.5 m, or a bare number in SI units",
        }


class WholeQuantity(Quantity):
    """Annotation of an integer with a physical dimension, in SI units."""

    def parse(self, value: Any) -> Any:
        """Convert text such as "240 Hz" to an integer. A fraction becomes a float, which validation rejects."""
        number = super().parse(value)
        return int(number) if isinstance(value, str) and number.is_integer() else number


Length = Annotated[float, Field(ge=-1e4, le=1e4), Quantity("length")]
PositiveLength = Annotated[float, Field(gt=0, le=1e4), Quantity("length")]
NonNegativeLength = Annotated[float, Field(ge=0, le=1e4), Quantity("length")]
MAX_DURATION_S = 86400
Duration = Annotated[float, Field(ge=0, le=MAX_DURATION_S), Quantity("duration")]
PositiveDuration = Annotated[float, Field(gt=0, le=MAX_DURATION_S), Quantity("duration")]
Angle = Annotated[float, Field(ge=-100, le=100), Quantity("angle")]
NonNegativeAngle = Annotated[float, Field(ge=0, le=100), Quantity("angle")]
PositiveAngle = Annotated[float, Field(gt=0, le=100), Quantity("angle")]
Speed = Annotated[float, Field(ge=-100, le=100), Quantity("speed")]
NonNegativeSpeed = Annotated[float, Field(ge=0, le=100), Quantity("speed")]
PositiveSpeed = Annotated[float, Field(gt=0, le=100), Quantity("speed")]
AngularSpeed = Annotated[float, Field(ge=-100, le=100), Quantity("angular speed")]
NonNegativeAngularSpeed = Annotated[float, Field(ge=0, le=100), Quantity("angular speed")]
PositiveAngularSpeed = Annotated[float, Field(gt=0, le=100), Quantity("angular speed")]
Acceleration = Annotated[float, Field(ge=-1000, le=1000), Quantity("acceleration")]
NonNegativeAcceleration = Annotated[float, Field(ge=0, le=1000), Quantity("acceleration")]
AngularAcceleration = Annotated[float, Field(ge=-1000, le=1000), Quantity("angular acceleration")]
PositiveAcceleration = Annotated[float, Field(gt=0, le=1000), Quantity("acceleration")]
PositiveAngularAcceleration = Annotated[float, Field(gt=0, le=1000), Quantity("angular acceleration")]
PositiveJerk = Annotated[float, Field(gt=0, le=1e6), Quantity("jerk")]
Mass = Annotated[float, Field(ge=0, le=1e5), Quantity("mass")]
PositiveMass = Annotated[float, Field(gt=0, le=1e5), Quantity("mass")]
Frequency = Annotated[float, Field(gt=0, le=1000), Quantity("frequency")]
Force = Annotated[float, Field(ge=-1e5, le=1e5), Quantity("force")]
Impulse = Annotated[float, Field(ge=-1e5, le=1e5), Quantity("impulse")]
Ratio = Annotated[float, Field(ge=0), Quantity("ratio")]
Friction = Annotated[float, Field(ge=0, le=2), Quantity("ratio")]
"""Friction coefficient of a rubber wheel on a surface: 1 on dry concrete, 0.3 on a wet floor, 0.1 on oil or ice."""
Probability = Annotated[float, Field(ge=0, le=1), Quantity("ratio")]


class Amount(NamedTuple):
    """Number with its unit as written; "" for a number without a unit."""

    number: float
    unit: str = ""


def to_common_unit(amounts: tuple[Amount, ...]) -> tuple[tuple[float, ...], str]:
    """Return the amounts as numbers in one unit, and this unit.

    If all amounts have the same unit, they keep it. Otherwise, the numbers are in SI units, and the unit is "". Raises
    ValueError for units of different dimensions.
    """
    units = {amount.unit for amount in amounts}
    if len(units) == 1:
        return tuple(amount.number for amount in amounts), units.pop()
    for factors in UNITS.values():
        if units <= {"", *factors}:
            return tuple(amount.number * factors.get(amount.unit, 1.0) for amount in amounts), ""
    names = " and ".join(f"`{unit}`" for unit in sorted(units - {""}))
    raise ValueError(f"{names} are units of different dimensions")


def si_number(value: Any) -> Any:
    """Convert text such as "50 cm" to a number in SI units; return any other value unchanged."""
    match = NUMBER_AND_UNIT_PATTERN.fullmatch(value) if isinstance(value, str) else None
    if match is None:
        return value
    factors = [units[match[2]] for units in UNITS.values() if match[2] in units]
    return float(match[1]) * factors[0] if factors else value


def exact_text(number: float, units: Mapping[str, float]) -> str:
    """Return a number as text, in the first of `units` in which 12 digits are exact, such as "500 mm/h".

    `units` are factors to SI units, by unit. The unit "" is not shown. If 12 digits are exact in no unit, return all
    digits in SI units.
    """
    for unit, factor in units.items():
        shown = f"{number / factor:.12g}"
        if float(shown) * factor == number:
            return f"{shown} {unit}".strip()
    return str(number)


def possible_units(text: str) -> dict[str, float]:
    """Return the unit of a quantity such as "20 km", and the SI unit of its dimension, with their factors to SI units.

    Return {} for other texts.
    """
    match = NUMBER_AND_UNIT_PATTERN.fullmatch(text)
    units = next((units for units in UNITS.values() if match and match[2] in units), {})
    si_units = {unit: factor for unit, factor in units.items() if factor == 1.0}
    return {match[2]: units[match[2]], **si_units} if match and units else {}


def _parse_amount(value: Any) -> Amount:
    """Return the amount in a YAML value. Raises PydanticCustomError for other values."""
    if isinstance(value, int | float) and not isinstance(value, bool):
        if not math.isfinite(value):
            raise PydanticCustomError("finite_number", "must be a finite number")
        return Amount(float(value))
    match = NUMBER_AND_UNIT_PATTERN.fullmatch(value) if isinstance(value, str) else None
    if match and any(match[2] in known for known in UNITS.values()) and math.isfinite(float(match[1])):
        return Amount(float(match[1]), match[2])
    found = _text(value) if isinstance(value, str) else "something else"
    problem = f"expected a number with or without a unit, got {found}"
    raise PydanticCustomError("amount", "{problem}", {"problem": problem})


_AMOUNT_SCHEMA = {"type": ["number", "string"], "description": "a number, with its unit if it has one"}
AnyAmount = Annotated[Amount, PlainValidator(_parse_amount), WithJsonSchema(_AMOUNT_SCHEMA)]
"""Amount of any dimension, which is given as a number or as text."""
