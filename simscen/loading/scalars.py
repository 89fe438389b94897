"""Plain scalars of YAML 1.2's core schema (spec 1.2.2, section 10.3.2).

One thing is stricter: a number with a leading zero is text, because YAML 1.1 read it as octal and 1.2 as decimal.
"""

import math
import re

from simscen.loading.tree import Scalar

LONGEST_INTEGER = 19

_WORDS: dict[str, Scalar] = {
    **dict.fromkeys(("", "~", "null", "Null", "NULL"), None),
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
    **dict.fromkeys((".inf", ".Inf", ".INF", "+.inf", "+.Inf", "+.INF"), math.inf),
    **dict.fromkeys(("-.inf", "-.Inf", "-.INF"), -math.inf),
    **dict.fromkeys((".nan", ".NaN", ".NAN"), math.nan),
}
_INTEGERS = (
    (re.compile(r"[-+]?(0|[1-9][0-9]*)"), 10),
    (re.compile(r"0o[0-7]+"), 8),
    (re.compile(r"0x[0-9a-fA-F]+"), 16),
)
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|(0|[1-9][0-9]*)(\.[0-9]*)?)([eE][-+]?[0-9]+)?")


def resolve(text: str) -> Scalar:
    """The value that a plain scalar stands for. Raises ValueError for an integer of more than 19 digits."""
    if text in _WORDS:
        return _WORDS[text]
    if text[0] not in "+-.0123456789":
        return text
    base = next((base for pattern, base in _INTEGERS if pattern.fullmatch(text)), None)
    if base is not None and len(text) > LONGEST_INTEGER:
        raise ValueError("integer too large")
    if base is not None:
        return int(text, 0 if base != 10 else 10)
    return float(text) if _FLOAT.fullmatch(text) else text
