"""Plain scalars of YAML 1.2's core schema (spec 1.2.2, section 10.3.2).

One thing is stricter: a number with a leading zero is text, because YAML 1.1 read it as octal and 1.2 as decimal.
"""

import math
import re
from typing import Any

import yaml

from simscen.loading.yaml.tree import Scalar

MAX_INTEGER_CHARS = 19

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


def parse_scalar(text: str) -> Scalar:
    """The value that a plain scalar stands for. Raises ValueError for an integer of more than 19 digits."""
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
# What source.py refuses in a file, and line breaks of YAML 1.1; a string with one of them is written with escapes.
_UNSPEAKABLE = re.compile("[\x7f-\x9f\u2028\u2029\u202a-\u202e\u2066-\u2069\ufeff\ufffe\uffff]")


class Dumper(yaml.SafeDumper):
    """Quotes a text that our reader would take for something else, such as 1e3; does not quote `on` or 1:30."""

    def resolve(self, kind: type[yaml.Node], value: Any, implicit: Any) -> Any:
        """The tag that our reader gives to a plain scalar."""
        if kind is yaml.ScalarNode and implicit[0]:
            return f"tag:yaml.org,2002:{_plain_type(value)}"
        return super().resolve(kind, value, implicit)  # type: ignore[no-untyped-call]

    def ignore_aliases(self, data: Any) -> bool:
        """Whatever stands twice is written twice."""
        return True


def to_yaml(data: Any, dumper: type[Dumper] = Dumper) -> str:
    """Lists, mappings and scalars as text that `compose` reads back equal; keys are strings, in the order given."""
    text: str = yaml.dump(data, Dumper=dumper, sort_keys=False, allow_unicode=True, width=1000)
    if _UNSPEAKABLE.search(text):
        text = yaml.dump(data, Dumper=dumper, sort_keys=False, allow_unicode=False, width=1000)
    return text


def _plain_type(text: str) -> str:
    try:
        return _TAGS[type(parse_scalar(text))]
    except ValueError:  # an integer too large for our reader
        return "int"
