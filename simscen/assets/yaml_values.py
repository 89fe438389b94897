"""Values of the YAML files that xacro files load with `xacro.load_yaml`."""

import math
from collections.abc import Callable

import yaml

from simscen.assets.folders import UnusableFile

MAX_DEPTH = 20
"""Maximum nesting of lists and mappings in a YAML file."""
UNITS = {
    "!radians": 1.0,
    "!degrees": math.pi / 180,
    "!meters": 1.0,
    "!millimeters": 0.001,
    "!foot": 0.3048,
    "!inches": 0.0254,
}
"""Factors to SI units, by tag of a value."""


def parse_yaml_values(content: bytes, evaluate: Callable[[str], float]) -> object:
    """Return the value of a YAML 1.1 document. Raises UnusableFile if it is invalid, too deep, or contains aliases.

    A number can have a unit of UNITS as tag, such as `!degrees 90`. `evaluate` converts the text of such a number, for
    example an expression of xacro.
    """
    try:
        return _Loader(content, evaluate).get_single_data()
    except yaml.MarkedYAMLError as error:
        line = 0 if error.problem_mark is None else error.problem_mark.line + 1
        raise UnusableFile(f"not valid YAML in line {line}: {error.problem}") from error
    except (yaml.YAMLError, ValueError) as error:
        raise UnusableFile("not valid YAML") from error


class _Loader(yaml.SafeLoader):
    """YAML loader without aliases, because a small file could then have a huge value."""

    def __init__(self, content: bytes, evaluate: Callable[[str], float]) -> None:
        super().__init__(content)
        self._evaluate, self._depth = evaluate, 0

    def compose_node(self, parent: yaml.Node | None, index: int) -> yaml.Node | None:
        """Return the next node. Raises UnusableFile for an alias, or if the node is nested too deep."""
        if self.check_event(yaml.AliasEvent):
            raise UnusableFile("aliases (`*name`) are not supported in YAML files")
        if self._depth > MAX_DEPTH:
            raise UnusableFile(f"lists and mappings are nested deeper than {MAX_DEPTH}")
        self._depth += 1
        node = super().compose_node(parent, index)
        self._depth -= 1
        return node

    def construct_with_unit(self, node: yaml.ScalarNode) -> float:
        """Return the number of a node with a tag of UNITS in SI units."""
        return self._evaluate(str(self.construct_scalar(node))) * UNITS[node.tag]


for _tag in UNITS:
    _Loader.add_constructor(_tag, _Loader.construct_with_unit)
