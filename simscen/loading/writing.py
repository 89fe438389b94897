"""YAML as our reader reads it: plain scalars mean what they mean in YAML 1.2, not in PyYAML's 1.1."""

import re
from typing import Any

import yaml

from simscen.loading.scalars import resolve

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
        return _TAGS[type(resolve(text))]
    except ValueError:  # an integer too large for our reader
        return "int"
