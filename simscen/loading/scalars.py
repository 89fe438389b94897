"""Plain scalars of YAML 1.2's core schema (spec 1.2.2, section 10.3.2).

One thing is stricter: a number with a leading zero is text, because YAML 1.1 read it as octal and 1.2 as decimal.
"""

import math
import re

from simscen.loading.tree import Scalar

LONGEST_INTEGER = 19

_NULL = frozenset({"", "~", "null", "Null", "NULL"})
_BOOL = {t: v for v, word in ((True, "true"), (False, "false")) for t in (word, word.capitalize(), word.upper())}
_INT = re.compile(r"[-+]?(0|[1-9][0-9]*)")
_OCTAL = re.compile(r"0o[0-7]+")
_HEX = re.compile(r"0x[0-9a-fA-F]+")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|(0|[1-9][0-9]*)(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
_INF = re.compile(r"[-+]?\.(inf|Inf|INF)")
_NAN = frozenset({".nan", ".NaN", ".NAN"})


def resolve(text: str) -> Scalar:
    """The value that a plain scalar stands for. Raises ValueError for an integer of more than 19 digits."""
    if text in _NULL:
        return None
    if text in _BOOL:
        return _BOOL[text]
    if text[0] not in "+-.0123456789":
        return text
    for pattern, base in ((_INT, 10), (_OCTAL, 8), (_HEX, 16)):
        if pattern.fullmatch(text):
            if len(text) > LONGEST_INTEGER:
                raise ValueError("integer too large")
            return int(text, base)
    if _FLOAT.fullmatch(text):
        return float(text)
    if _INF.fullmatch(text):
        return -math.inf if text[0] == "-" else math.inf
    return math.nan if text in _NAN else text
