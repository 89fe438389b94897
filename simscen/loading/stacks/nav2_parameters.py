"""Read Nav2 parameter files, and replace `stack: {nav2_params: FILE}` with the parameters of that file."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError

from simscen.core.clock import Clock
from simscen.core.errors import Problem
from simscen.loading.files.paths import PathProblem
from simscen.loading.stacks.nav2_mapping import Known, Translation
from simscen.loading.stacks.nav2_nodes import translate, unknown_nodes
from simscen.loading.yaml.library import Library, merge_mappings
from simscen.loading.yaml.parser import parse_yaml
from simscen.loading.yaml.textfile import read_text
from simscen.loading.yaml.tree import (
    Entry,
    MappingNode,
    Node,
    Position,
    ScalarNode,
    SequenceNode,
    child,
    value_position,
)
from simscen.ros2.nav2.parameters import Offer, check

PARAMETERS = "ros__parameters"
EVERY_NODE = "**"


@dataclass(frozen=True)
class Nav2Parameters:
    """Parameters by node and dotted name, and their positions; `display_name` is the name of the file in messages.

    Parameters of `/**` apply to every node of the file. `notes` are warnings about duplicate keys and nodes.
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
    sections = list(_nodes(tree, ""))
    found = dict(sections)
    notes += tuple(
        _note(section.position, f"only the last of the nodes called {name} is used")
        for name, section in sections
        if section is not found[name]
    )
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


NAV2_PARAMS, STACK, ROBOTS = "nav2_params", "stack", "robots"


@dataclass
class ExpandedTree:
    """Tree with the parameters of its Nav2 files, the problems of these files, and notes on unused parameters."""

    tree: MappingNode
    problems: list[Problem] = field(default_factory=list)
    notes: list[Problem] = field(default_factory=list)


def with_nav2_parameters(tree: MappingNode, library: Library) -> ExpandedTree:
    """Return a scenario in which each stack, also those of its robots, has the parameters of its Nav2 file."""
    result = ExpandedTree(tree)
    robots = child(tree, ROBOTS)
    if isinstance(robots, MappingNode):
        own = {
            name: Entry(entry.key, _with_expanded_stack(entry.value, library, result))
            for name, entry in robots.entries.items()
        }
        tree = MappingNode(
            tree.position, {**tree.entries, ROBOTS: Entry(tree.entries[ROBOTS].key, MappingNode(robots.position, own))}
        )
    result.tree = _with_expanded_stack(tree, library, result)
    return result


def _with_expanded_stack(tree: Node, library: Library, result: ExpandedTree) -> Any:
    stack = child(tree, STACK)
    if not isinstance(tree, MappingNode) or not isinstance(stack, MappingNode) or NAV2_PARAMS not in stack.entries:
        return tree
    filled = _merge_parameters(stack, library, result)
    return MappingNode(tree.position, {**tree.entries, STACK: Entry(tree.entries[STACK].key, filled)})


def _merge_parameters(stack: MappingNode, library: Library, result: ExpandedTree) -> MappingNode:
    """Return a `stack:` section merged onto its parameter file, which is merged onto Nav2's defaults."""
    written, position = stack.entries[NAV2_PARAMS].value, value_position(stack, (NAV2_PARAMS,))
    if not isinstance(written, ScalarNode) or not isinstance(written.value, str):
        return stack  # validation reports the wrong type
    file = library.sandbox.find(written.value, library.folder_of(position))
    if isinstance(file, PathProblem):
        result.problems.append(Problem(*position, file.code, file.message, file.hint))
        return stack
    display_name = library.sandbox.display_name(file)
    parameters = read_nav2_parameters(file, display_name)
    if not isinstance(parameters, Nav2Parameters):
        result.problems += parameters
        return stack
    library.add({display_name: parameters.text}, {display_name: file})
    profile = MappingNode(position, {"profile": Entry(position, ScalarNode(position, "nav2"))})
    clock = _clock(result.tree)
    translations = [_with_possible_rate(one, clock) for one in translate(parameters.nodes, _known_parameters())]
    below = profile
    for translation in translations:
        if translation.path:
            below = merge_mappings(below, _nested(translation, parameters))
    result.notes += sorted({*parameters.notes, *_notes(translations, parameters)})
    return merge_mappings(stack, below)


def _clock(scenario: MappingNode) -> Clock:
    from simscen.model.scenario import Physics

    physics = child(scenario, "physics")
    try:
        return Clock(Physics.model_validate(physics.plain if physics else {}).tick_rate)
    except ValidationError:
        return Clock()  # validation reports the error


def _with_possible_rate(one: Translation, clock: Clock) -> Translation:
    """Return a translation in which the controller frequency is the nearest one with a period of whole ticks."""
    if one.path != ("controller_frequency",) or not isinstance(one.value, int | float) or one.value <= 0:
        return one
    try:
        clock.period(one.value)
    except ValueError as error:
        hint = "the nearest is used; write `stack: {controller_frequency: …}` in the scenario for another one"
        return replace(one, value=clock.nearest_rate(one.value), note=str(error), hint=hint)
    return one


def _nested(one: Translation, parameters: Nav2Parameters) -> MappingNode:
    position = parameters.positions[one.node, one.parameter]
    node: Node = _node(one.value, position)
    for key in reversed(one.path):
        node = MappingNode(position, {key: Entry(position, node)})
    assert isinstance(node, MappingNode)
    return node


def _node(value: Any, position: Position) -> Node:
    if isinstance(value, list):
        return SequenceNode(position, tuple(_node(item, position) for item in value))
    return ScalarNode(position, value)


def _notes(translations: Sequence[Translation], parameters: Nav2Parameters) -> Iterator[Problem]:
    """Yield notes on unused parameters: one for each with a reason, one per node for all others."""
    for translation in translations:
        if translation.note:
            yield _note(
                parameters.positions[translation.node, translation.parameter],
                f"{translation.node}: `{translation.parameter}`: {translation.note}",
                translation.hint,
            )
    used = {
        parameters.positions[translation.node, translation.parameter]
        for translation in translations
        if translation.path
    }
    for node in parameters.nodes:
        positions = [
            (parameters.positions[node, translation.parameter], translation.parameter)
            for translation in translations
            if translation.node == node
            and not translation.path
            and not translation.note
            and parameters.positions[node, translation.parameter]
            not in used  # parameters of `/**` may be used by another node
        ]
        if positions:
            names = ", ".join(f"{name} ({position.line})" for position, name in sorted(positions))
            yield _note(min(positions)[0], f"{node}: simscen has no {names}")
    for node in unknown_nodes(parameters.nodes):
        node_positions = [position for (name, _), position in parameters.positions.items() if name == node]
        yield _note(min(node_positions), f"simscen has no node like {node}")


def _note(position: Position, message: str, hint: str = "it is ignored") -> Problem:
    return Problem(*position, code="SC341", message=message, hint=hint, severity="warning")


def _known_parameters() -> Known:
    """Return the parameters of the reference stack, by section or by type; `a.b` is `b` in the mapping `a`."""
    from simscen.model import controllers, costmaps, localizers, mppi, planners, recovery

    models: dict[str, type[BaseModel]] = {
        "amcl": localizers.Amcl,
        "progress_checker": controllers.ProgressChecker,
        "simple": controllers.SimpleGoalChecker,
        "regulated_pure_pursuit": controllers.RegulatedPurePursuit,
        "dwb": controllers.DynamicWindow,
        "mppi": mppi.Mppi,
        "navfn": planners.Navfn,
        "smac_2d": planners.Smac2d,
        "costmap": costmaps.Costmap,
        "local_costmap": costmaps.LocalCostmap,
        "denoise_layer": costmaps.DenoiseLayer,
        "recovery": recovery.Recovery,
    }
    return {name: tuple(_names(model)) for name, model in models.items()}


def _names(model: type[BaseModel]) -> Iterator[str]:
    for name, model_field in model.model_fields.items():
        yield name
        if isinstance(model_field.annotation, type) and issubclass(model_field.annotation, BaseModel):
            yield from (f"{name}.{part}" for part in model_field.annotation.model_fields)
