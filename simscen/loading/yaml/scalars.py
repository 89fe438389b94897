"""Reading and writing of scalars by the core schema of YAML 1.2 (YAML 1.2.2, section 10.3.2).

PyYAML implements YAML 1.1. Numbers with a leading zero are text here, because YAML 1.1 reads them as octal, but YAML
1.2 as decimal.
"""

import math
import re
from typing import Any

import yaml

from simscen.loading.yaml.tree import Scalar

MAX_INTEGER_CHARS = 19
"""Largest number of characters of an integer: the length of the largest 64-bit integer."""

_CONSTANTS: dict[str, Scalar] = {
    **dict.fromkeys(("", "~", "null", "Null", "NULL"), None),
    **dict.fromkeys(("true", "True", "TRUE"), True),
    **dict.fromkeys(("false", "False", "FALSE"), False),
    **dict.fromkeys((".inf", ".Inf", ".INF", "+.inf", "+.Inf", "+.INF"), math.inf),
    **dict.fromkeys(("-.inf", "-.Inf", "-.INF"), -math.inf),
    **dict.fromkeys((".nan", ".NaN", ".NAN"), math.nan),
}
"""Values of the texts for null, booleans, infinity, and NaN."""
_INTEGER_PATTERNS = (
    (re.compile(r"[-+]?(0|[1-9][0-9]*)"), 10),
    (re.compile(r"0o[0-7]+"), 8),
    (re.compile(r"0x[0-9a-fA-F]+"), 16),
)
"""Patterns of integers, with their bases."""
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


_TAGS = {str: "str", bool: "bool", int: "int", float: "float", type(None): "null"}
"""Names of YAML types, by Python type."""
# Characters that `read_text` rejects, and line breaks of YAML 1.1; strings with one of them are written with escapes.
_NEEDS_ESCAPES = re.compile("[\x7f-\x9f\u2028\u2029\u202a-\u202e\u2066-\u2069\ufeff\ufffe\uffff]")


class Dumper(yaml.SafeDumper):
    """PyYAML dumper for YAML 1.2. It quotes text such as `1e3` (a number in YAML 1.2), but not `on` or `1:30`."""

    def resolve(self, kind: type[yaml.Node], value: Any, implicit: Any) -> Any:
        """Return the tag of a node. For a scalar without quotes, `parse_scalar` determines the tag."""
        if kind is yaml.ScalarNode and implicit[0]:
            return f"tag:yaml.org,2002:{_plain_type(value)}"
        return super().resolve(kind, value, implicit)  # type: ignore[no-untyped-call]

    def ignore_aliases(self, data: Any) -> bool:
        """Return True, so that no aliases are written."""
        return True


def to_yaml(data: Any, dumper: type[Dumper] = Dumper) -> str:
    """Return data as YAML text, which `parse_yaml` reads back unchanged. Keys must be text, and keep their order."""
    text: str = yaml.dump(data, Dumper=dumper, sort_keys=False, allow_unicode=True, width=1000)
    if _NEEDS_ESCAPES.search(text):
        text = yaml.dump(data, Dumper=dumper, sort_keys=False, allow_unicode=False, width=1000)
    return text


def _plain_type(text: str) -> str:
    """Return the name of the YAML type of a scalar without quotes, such as "int"."""
    try:
        return _TAGS[type(parse_scalar(text))]
    except ValueError:  # an integer that parse_scalar rejects
        return "int"
