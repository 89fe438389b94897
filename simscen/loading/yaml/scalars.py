"""Values of scalars according to the core schema of YAML 1.2 (YAML 1.2.2, section 10.3.2).

PyYAML implements YAML 1.1. Numbers with a leading zero are text here, because they are octal in YAML 1.1, but decimal
in YAML 1.2.
"""

import math
import re

from simscen.loading.yaml.tree import Scalar

MAX_INTEGER_CHARS = 19
"""Maximum number of characters of an integer: the length of the largest 64-bit integer."""

_CONSTANTS: dict[str, Scalar] = {
    **dict.fromkeys(("", "~", "null", "Null", "NULL"), None),
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
    **dict.fromkeys((".inf", ".Inf", ".INF", "+.inf", "+.Inf", "+.INF"), math.inf),
    **dict.fromkeys(("-.inf", "-.Inf", "-.INF"), -math.inf),
    **dict.fromkeys((".nan", ".NaN", ".NAN"), math.nan),
}
_INTEGER_PATTERNS = (
    (re.compile(r"[-+]?(0|[1-9][0-9]*)"), 10),
    (re.compile(r"0o[0-7]+"), 8),
    (re.compile(r"0x[0-9a-fA-F]+"), 16),
)
_FLOAT_PATTERN = re.compile(r"[-+]?(\.[0-9]+|(0|[1-9][0-9]*)(\.[0-9]*)?)([eE][-+]?[0-9]+)?")


def parse_scalar(text: str) -> Scalar:
    """Return the value of a scalar without quotes. Raises ValueError for an integer with more than 19 characters."""
    if text in _CONSTANTS:
        return _CONSTANTS[text]
    if text[0] not in "+-.0123456789":
        return text
    base = next((base for pattern, base in _INTEGER_PATTERNS if pattern.fullmatch(text)), None)
    if base is not None and len(text) > MAX_INTEGER_CHARS:
        raise ValueError("integer too large")
    if base is not None:
        return int(text, 0 if base != 10 else 10)
    return float(text) if _FLOAT_PATTERN.fullmatch(text) else text
