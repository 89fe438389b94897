"""Read plain scalars by the core schema of YAML 1.2 (spec 1.2.2, section 10.3.2), and write data that is read so.

PyYAML alone reads and writes YAML 1.1. A number with a leading zero is text here, because YAML 1.1 reads it as octal
and YAML 1.2 as decimal.
"""

import math
import re
from typing import Any

import yaml

from simscen.loading.yaml.tree import Scalar

MAX_INTEGER_CHARS = 19
"""Largest number of characters of an integer: as many as the largest 64-bit integer has."""

_WORDS: dict[str, Scalar] = {
    **dict.fromkeys(("", "~", "null", "Null", "NULL"), None),
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
    **dict.fromkeys((".inf", ".Inf", ".INF", "+.inf", "+.Inf", "+.INF"), math.inf),
    **dict.fromkeys(("-.inf", "-.Inf", "-.INF"), -math.inf),
    **dict.fromkeys((".nan", ".NaN", ".NAN"), math.nan),
}
"""Text → value, for all values that are no numbers."""
_INTEGERS = (
    (re.compile(r"[-+]?(0|[1-9][0-9]*)"), 10),
    (re.compile(r"0o[0-7]+"), 8),
    (re.compile(r"0x[0-9a-fA-F]+"), 16),
)
"""Patterns of integers, each with its base."""
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|(0|[1-9][0-9]*)(\.[0-9]*)?)([eE][-+]?[0-9]+)?")


def parse_scalar(text: str) -> Scalar:
    """Return the value of a scalar without quotes. Raises ValueError for an integer of more than 19 characters."""
    if text in _WORDS:
        return _WORDS[text]
    if text[0] not in "+-.0123456789":
        return text
    base = next((base for pattern, base in _INTEGERS if pattern.fullmatch(text)), None)
    if base is not None and len(text) > MAX_INTEGER_CHARS:
        raise ValueError("integer too large")
    if base is not None:
        return int(text, 0 if base != 10 else 10)
    return float(text) if _FLOAT.fullmatch(text) else text


_TAGS = {str: "str", bool: "bool", int: "int", float: "float", type(None): "null"}
"""Type of a value → name of its type in YAML."""
# Characters that `read_text` rejects, and line breaks of YAML 1.1; strings with one of them are written with escapes.
_NEEDS_ESCAPES = re.compile("[\x7f-\x9f\u2028\u2029\u202a-\u202e\u2066-\u2069\ufeff\ufffe\uffff]")


class Dumper(yaml.SafeDumper):
    """PyYAML writer for YAML 1.2: quotes text such as `1e3` that 1.2 reads as a number, but not `on` or `1:30`."""

    def resolve(self, kind: type[yaml.Node], value: Any, implicit: Any) -> Any:
        """Return the tag of a node; plain scalars have the type that `parse_scalar` gives them."""
        if kind is yaml.ScalarNode and implicit[0]:
            return f"tag:yaml.org,2002:{_plain_type(value)}"
        return super().resolve(kind, value, implicit)  # type: ignore[no-untyped-call]

    def ignore_aliases(self, data: Any) -> bool:
        """Return True: data that occurs several times is written several times, without aliases."""
        return True


def to_yaml(data: Any, dumper: type[Dumper] = Dumper) -> str:
    """Return data as YAML text that `parse_yaml` reads back equal. Keys must be text; they keep their order."""
    text: str = yaml.dump(data, Dumper=dumper, sort_keys=False, allow_unicode=True, width=1000)
    if _NEEDS_ESCAPES.search(text):
        text = yaml.dump(data, Dumper=dumper, sort_keys=False, allow_unicode=False, width=1000)
    return text


def _plain_type(text: str) -> str:
    """Return the name of YAML's type of a scalar without quotes, such as "int"."""
    try:
        return _TAGS[type(parse_scalar(text))]
    except ValueError:  # an integer that parse_scalar rejects
        return "int"
