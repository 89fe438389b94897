"""Conversion of values to YAML text, if possible in the notation of the replaced text."""

import json
import math
import re
import textwrap
from typing import Any

from simscen.loading.yaml.parser import parse_yaml
from simscen.spec.quantities import NUMBER_AND_UNIT_PATTERN, UNITS, si_number

MAX_LINE_CHARACTERS = 120
"""Maximum number of characters in a line of a folded block scalar (`>`)."""
MAX_DECIMALS = 6
"""Maximum number of decimal places of a number."""
MAX_PADDED_DECIMALS = 3
"""Maximum number of decimal places to which trailing zeros are added."""
NUMBER_TOLERANCE = 2e-6
"""Difference up to which two numbers count as equal, in the unit of the text."""

_PLAIN_NUMBER = re.compile(r"[-+]?(?:[0-9]+(?:\.([0-9]*))?|\.([0-9]+))")
_INFINITE_NUMBERS = {"nan": ".nan", "inf": ".inf", "-inf": "-.inf"}
"""Numbers that are not finite as YAML, by their text in Python."""
_UNPRINTABLE = re.compile("[\x00-\x1f\x7f-\x9f\u2028\u2029\u202a-\u202e\u2066-\u2069\ufeff\ufffe\uffff]")


def flow_text(value: Any) -> str:
    """Return a value as YAML on one line, with lists in brackets and mappings in braces."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{string_text(str(key))}: {flow_text(item)}" for key, item in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(flow_text(item) for item in value) + "]"
    return scalar_text(value)


def scalar_text(value: Any) -> str:
    """Return a scalar as YAML on one line, valid in block and flow style."""
    if value is None:
        return "null"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return number_text(value)
    return str(value) if isinstance(value, int) else string_text(str(value))


def replacement_text(value: Any, old: str, style: str) -> str:
    """Return a scalar as YAML with the unit, decimal places, and quotes of the text `old`.

    A number `value` is in SI units. `style` is the YAML style of `old`: a quote, `>`, `|`, or "" for plain text.
    """
    if isinstance(value, int | float) and not isinstance(value, bool):
        quote = style if style in ("'", '"') else ""
        inner = old[1:-1] if quote else old
        text = _quantity_text(float(value), inner)
        return f"{quote}{text}{quote}" if _scale(inner) else text
    if isinstance(value, str) and style in (">", "|"):
        lines = [line for line in old.split("\n")[1:] if line.strip()]
        indent = len(lines[0]) - len(lines[0].lstrip()) if lines else 0
        return (_block_scalar_text(value, old, indent) if indent else None) or scalar_text(value)
    if isinstance(value, str) and style == "'" and not _UNPRINTABLE.search(value):
        return "'" + value.replace("'", "''") + "'"
    if isinstance(value, str) and style == '"':
        return _quoted_text(value)
    return scalar_text(value)


def _quantity_text(value: float, old: str) -> str:
    """Return a number in SI units as text with the unit and the decimal places of the text `old`, e.g. "1.50 m"."""
    scale = _scale(old)
    match = NUMBER_AND_UNIT_PATTERN.fullmatch(old) if scale else None
    number, unit = (match[1], old[match.end(1) :].rstrip()) if match else (old.strip(), "")
    plain = _PLAIN_NUMBER.fullmatch(number)
    return number_text(value / (scale or 1.0), len(plain[1] or plain[2] or "") if plain else 0) + unit


def number_text(value: float, decimals: int = 0) -> str:
    """Return a number as text with at least min(`decimals`, MAX_PADDED_DECIMALS) decimal places."""
    if not math.isfinite(value) or abs(value) >= 1e9 or 0 < abs(value) < 10.0 ** (1 - MAX_DECIMALS):
        return repr(value) if math.isfinite(value) else _INFINITE_NUMBERS[str(value)]
    number, _, places = f"{value:.{MAX_DECIMALS}f}".partition(".")
    places = places.rstrip("0").ljust(min(decimals, MAX_PADDED_DECIMALS), "0")
    text = f"{number}.{places}" if places else number
    return text.removeprefix("-") if float(text) == 0 else text


def is_same_value(value: Any, other: Any) -> bool:
    """Return whether two values are equal. Numbers and quantities with units are compared with a tolerance."""
    if isinstance(value, dict) and isinstance(other, dict):
        return value.keys() == other.keys() and all(is_same_value(value[key], other[key]) for key in value)
    if isinstance(value, list) and isinstance(other, list):
        return len(value) == len(other) and all(map(is_same_value, value, other))
    if value == other or value is other:
        return isinstance(value, bool) == isinstance(other, bool)
    if isinstance(value, bool) or isinstance(other, bool):
        return False
    numbers = si_number(value), si_number(other)
    if not all(isinstance(number, int | float) for number in numbers):
        return False
    scale = max(_scale(value) or 1.0, _scale(other) or 1.0)
    return math.isclose(*numbers, rel_tol=1e-9, abs_tol=NUMBER_TOLERANCE * scale)


def _quoted_text(text: str) -> str:
    return _UNPRINTABLE.sub(lambda match: f"\\u{ord(match[0]):04x}", json.dumps(text, ensure_ascii=False))


def string_text(text: str) -> str:
    """Return a string as YAML, without quotes if the plain string is valid in block and flow style."""
    if "\n" in text or _UNPRINTABLE.search(text) or text != text.strip():
        return _quoted_text(text)
    tree, problems = parse_yaml(f"[{{k: {text}}}, {{{text}: 1}}]", "")
    if problems or tree is None or tree.plain != [{"k": text}, {text: 1}]:
        return _quoted_text(text)
    return text


def _scale(value: Any) -> float:
    """Return the factor from the unit of a value such as "2.5 cm" to the SI unit; 0 without a known unit."""
    match = NUMBER_AND_UNIT_PATTERN.fullmatch(value) if isinstance(value, str) else None
    return next((units[match[2]] for units in UNITS.values() if match and match[2] in units), 0.0)


def _block_scalar_text(value: str, old: str, indent: int) -> str | None:
    """Return a string in the style of the block scalar `old` (`>` or `|`); None if the style cannot represent it.

    `indent` is the number of spaces before each line.
    """
    header = old.split("\n", 1)[0].split("#", maxsplit=1)[0].strip()
    body = value.removesuffix("\n")
    if not body.strip() or header[1:] not in ("", "-"):
        return None
    header = header[0] if value.endswith("\n") else f"{header[0]}-"
    lines = body.split("\n") if header[0] == "|" else _folded_lines(body, MAX_LINE_CHARACTERS - indent)
    text = "\n".join([header, *(" " * indent + line if line else "" for line in lines)])
    tree, problems = parse_yaml(f"{' ' * (indent - 1)}? key\n{' ' * (indent - 1)}: {text}\n", "")
    is_same = not problems and tree is not None and tree.plain == {"key": value}
    return text if is_same else None


def _folded_lines(text: str, width: int) -> list[str]:
    """Return the lines of a folded block scalar (`>`), in which an empty line represents a line break."""
    lines: list[str] = []
    for number, paragraph in enumerate(text.split("\n")):
        lines += [""] if number else []
        lines += textwrap.wrap(paragraph, width, break_long_words=False, break_on_hyphens=False)
    return lines
