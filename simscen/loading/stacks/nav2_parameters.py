"""Reads Nav2 parameter files, and compares their topics and frames with those of simscen."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from simscen.core.errors import Problem
from simscen.loading.yaml.parser import parse_yaml
from simscen.loading.yaml.textfile import read_text, with_source_line
from simscen.loading.yaml.tree import MappingNode, Node, Position, entries_of
from simscen.ros2.nav2.parameter_rules import PublishedNames, check

PARAMETERS_KEY = "ros__parameters"
"""Key with the parameters of a node in a ROS 2 parameter file."""
ALL_NODES = "**"
"""Name that stands for all nodes: `/**` without the slash."""


@dataclass(frozen=True)
class Nav2Parameters:
    """Content of a Nav2 parameter file."""

    display_name: str
    """Path of the file in messages."""
    nodes: Mapping[str, Mapping[str, Any]]
    """Parameters by name of the node, then by dotted name. The parameters of `/**` are included in each node."""
    positions: Mapping[tuple[str, str], Position]
    """Positions of the values, by (name of the node, dotted name of the parameter)."""
    text: str
    """Text of the file."""
    notes: tuple[Problem, ...] = ()
    """Warnings about duplicate keys and nodes."""

    def problems(self, published: PublishedNames) -> list[Problem]:
        """Return a problem for each parameter that does not match the `published` topics and frames."""
        found = [
            Problem(
                *self.positions[problem.node, problem.parameter],
                code="SC340",
                message=f"{problem.node}: {problem.message}",
                severity="error" if problem.is_severe else "warning",
            )
            for problem in check(self.nodes, published)
        ]
        return [with_source_line(problem, {self.display_name: self.text}) for problem in sorted(found)]


def read_nav2_parameters(path: Path, display_name: str = "") -> Nav2Parameters | list[Problem]:
    """Return the parameters in the file `path`, or the problems of the file.

    `display_name` is the path in messages; "" for `path`.
    """
    display_name = display_name or str(path)
    text = read_text(path, display_name)
    if isinstance(text, Problem):
        return [text]
    tree, problems = parse_yaml(text, display_name, allow_duplicates=True)
    notes = tuple(problem for problem in problems if problem.severity == "warning")
    if len(notes) < len(problems) or tree is None:
        return [problem for problem in problems if problem not in notes]
    sections = list(_ros_nodes(tree, ""))
    found = dict(sections)
    notes += tuple(
        ignored_note(section.position, f"only the last of the nodes called {name} is used")
        for name, section in sections
        if section is not found[name]
    )
    if not found:
        return [Problem(display_name, 0, 0, "SC340", f"not a Nav2 parameter file: it has no key {PARAMETERS_KEY}")]
    nodes: dict[str, dict[str, Any]] = {}
    positions: dict[tuple[str, str], Position] = {}
    for_all_nodes = found.pop(ALL_NODES, None)
    for name, parameters in found.items() if found else ((ALL_NODES, MappingNode(Position(display_name, 0, 0), {})),):
        nodes[name] = {}
        for source in (for_all_nodes, parameters):
            for key, value in _dotted_parameters(source, "") if source else ():
                nodes[name][key] = value.plain
                positions[name, key] = value.position
    return Nav2Parameters(display_name, nodes, positions, text, notes)


def is_nav2_parameter_file(text: str, display_name: str) -> bool:
    """Return whether the text of a file contains ROS 2 parameters of nodes, and no top-level key `simscen`."""
    if PARAMETERS_KEY not in text:
        return False
    tree, _ = parse_yaml(text, display_name, allow_duplicates=True)
    return isinstance(tree, MappingNode) and "simscen" not in tree.entries and any(_ros_nodes(tree, ""))


def _ros_nodes(tree: Node, name: str) -> Iterator[tuple[str, MappingNode]]:
    """Yield the name (without namespace) and the parameters of each ROS node in a tree. `name` is the key of `tree`."""
    for key, entry in entries_of(tree).items():
        if key == PARAMETERS_KEY and isinstance(entry.value, MappingNode):
            yield name, entry.value
        else:
            yield from _ros_nodes(entry.value, key.rpartition("/")[2])


def _dotted_parameters(mapping: MappingNode, prefix: str) -> Iterator[tuple[str, Node]]:
    """Yield the dotted name and the value of each parameter in nested mappings. All names begin with `prefix`."""
    for key, entry in mapping.entries.items():
        if isinstance(entry.value, MappingNode):
            yield from _dotted_parameters(entry.value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", entry.value


def ignored_note(position: Position, message: str, hint: str = "it is ignored") -> Problem:
    """Return a warning about a parameter that is ignored or changed."""
    return Problem(*position, code="SC341", message=message, hint=hint, severity="warning")
