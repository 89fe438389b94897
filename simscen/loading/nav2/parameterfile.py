"""Nav2 parameter files with the positions of their parameters."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from simscen.core.errors import Problem
from simscen.loading.yaml.parser import parse_yaml
from simscen.loading.yaml.textfile import read_text
from simscen.loading.yaml.tree import MappingNode, Node, Position
from simscen.ros2.nav2_parameters import Offer, check

PARAMETERS = "ros__parameters"
EVERY_NODE = "**"


@dataclass(frozen=True)
class Nav2Parameters:
    """Parameters by node and dotted name, and their positions; `display_name` is the name of the file in messages.

    Parameters of `/**` apply to every node of the file. `notes` are warnings about duplicate keys.
    """

    display_name: str
    nodes: Mapping[str, Mapping[str, Any]]
    positions: Mapping[tuple[str, str], Position]
    text: str
    notes: tuple[Problem, ...] = ()

    def problems(self, offer: Offer) -> list[Problem]:
        """Return the parameters that do not fit what simscen publishes, in the order of the file."""
        found = [
            Problem(
                *self.positions[finding.node, finding.parameter],
                code="SC340",
                message=f"{finding.node}: {finding.message}",
                severity="error" if finding.severe else "warning",
            )
            for finding in check(self.nodes, offer)
        ]
        lines = self.text.split("\n")
        return [replace(problem, source=lines[problem.line - 1]) for problem in sorted(found)]


def read_nav2_parameters(path: Path, display_name: str = "") -> Nav2Parameters | list[Problem]:
    """Return the parameters in a file, or its problems; `display_name` is its name in problems (default: its path)."""
    display_name = display_name or str(path)
    text = read_text(path, display_name)
    if isinstance(text, Problem):
        return [text]
    tree, problems = parse_yaml(text, display_name, last_wins=True)
    notes = tuple(problem for problem in problems if problem.severity == "warning")
    if len(notes) < len(problems) or tree is None:
        return [problem for problem in problems if problem not in notes]
    found = dict(_nodes(tree, ""))
    if not found:
        return [Problem(display_name, 0, 0, "SC340", f"not a Nav2 parameter file: it has no key {PARAMETERS}")]
    nodes: dict[str, dict[str, Any]] = {}
    positions: dict[tuple[str, str], Position] = {}
    for_all_nodes = found.pop(EVERY_NODE, None)
    for name, parameters in found.items() if found else ((EVERY_NODE, MappingNode(Position(display_name, 0, 0), {})),):
        nodes[name] = {}
        for source in (for_all_nodes, parameters):
            for key, value in _flat(source, "") if source else ():
                nodes[name][key] = value.plain
                positions[name, key] = value.position
    return Nav2Parameters(display_name, nodes, positions, text, notes)


def is_nav2_parameter_file(text: str, display_name: str) -> bool:
    """Return whether a text is a Nav2 parameter file and not a file of simscen."""
    if PARAMETERS not in text:
        return False
    tree, _ = parse_yaml(text, display_name, last_wins=True)
    return isinstance(tree, MappingNode) and "simscen" not in tree.entries and any(_nodes(tree, ""))


def _nodes(node: Node, name: str) -> Iterator[tuple[str, MappingNode]]:
    """Yield every node of the file and its parameters, without namespaces."""
    for key, entry in node.entries.items() if isinstance(node, MappingNode) else ():
        if key == PARAMETERS and isinstance(entry.value, MappingNode):
            yield name, entry.value
        else:
            yield from _nodes(entry.value, key.rpartition("/")[2])


def _flat(fields: MappingNode, prefix: str) -> Iterator[tuple[str, Node]]:
    for key, entry in fields.entries.items():
        if isinstance(entry.value, MappingNode):
            yield from _flat(entry.value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", entry.value
