"""Writing of data as YAML 1.2 text."""

import re
from typing import Any

import yaml

from simscen.loading.yaml.scalars import parse_scalar
from simscen.model.world import WorldSpec

_TAGS = {str: "str", bool: "bool", int: "int", float: "float", type(None): "null"}
"""Names of YAML types, by Python type."""
# Characters that `read_text` rejects, and line breaks of YAML 1.1; strings with one of them are written with escapes.
_NEEDS_ESCAPES = re.compile("[\x7f-\x9f\u2028\u2029\u202a-\u202e\u2066-\u2069\ufeff\ufffe\uffff]")


class Dumper(yaml.SafeDumper):
    """PyYAML dumper for YAML 1.2. It quotes text such as `1e3` (a number in YAML 1.2), but not `on` or `1:30`."""

    def resolve(self, kind: type[yaml.Node], value: Any, implicit: Any) -> Any:
        """Return the tag of a node. For a scalar without quotes, `parse_scalar` determines the tag."""
        if kind is yaml.ScalarNode and implicit[0]:
            try:
                return f"tag:yaml.org,2002:{_TAGS[type(parse_scalar(value))]}"
            except ValueError:  # an integer that parse_scalar rejects
                return "tag:yaml.org,2002:int"
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


class CompactDumper(Dumper):
    """YAML dumper that writes lists without mappings in brackets, and inner mappings with a scalar in braces."""


def _represent_list(dumper: yaml.SafeDumper, value: list[Any]) -> yaml.Node:
    flat = not any(isinstance(item, dict) for item in value)
    return dumper.represent_sequence("tag:yaml.org,2002:seq", value, flow_style=flat)


def _represent_mapping(dumper: yaml.SafeDumper, value: dict[str, Any]) -> yaml.Node:
    """Return the YAML node of a mapping, in braces if it contains a scalar and is not the whole file."""
    flat = any(not isinstance(item, dict | list) for item in value.values()) and "simscen" not in value
    return dumper.represent_mapping("tag:yaml.org,2002:map", value, flow_style=flat)


CompactDumper.add_representer(list, _represent_list)
CompactDumper.add_representer(dict, _represent_mapping)


def world_text(spec: WorldSpec) -> str:
    """Return the text of a `*.world.yaml` file with this world, without default values."""
    data = spec.model_dump(mode="json", exclude_defaults=True)
    return to_yaml(_in_order(data), CompactDumper)


def _in_order(value: Any) -> Any:
    """Return the data with the keys `simscen` and `name` at the beginning of each mapping."""
    if isinstance(value, list):
        return [_in_order(item) for item in value]
    if not isinstance(value, dict):
        return value
    first = [key for key in ("simscen", "name") if key in value]
    return {key: _in_order(value[key]) for key in dict.fromkeys((*first, *value))}
