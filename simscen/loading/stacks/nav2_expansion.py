"""Expansion of `stack: {nav2_params: FILE}`: the translated parameters of the Nav2 file replace its path."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from pydantic import BaseModel, ValidationError

from simscen.core.clock import Clock
from simscen.core.errors import Problem
from simscen.loading.files.paths import PathProblem
from simscen.loading.stacks.nav2_mapping import KnownParameters, Translation
from simscen.loading.stacks.nav2_nodes import translate, unknown_nodes
from simscen.loading.stacks.nav2_parameters import Nav2Parameters, ignored_note, read_nav2_parameters
from simscen.loading.yaml.library import Library, merge_mappings
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

NAV2_PARAMS, STACK, ROBOTS = "nav2_params", "stack", "robots"
"""Keys of a scenario, and of its section `stack`."""


@dataclass
class ExpandedTree:
    """YAML tree of a scenario or stack file that contains the parameters of its Nav2 files.

    `problems` are errors in the Nav2 files. `notes` are warnings about ignored and changed parameters.
    """

    tree: MappingNode
    problems: list[Problem] = field(default_factory=list)
    notes: list[Problem] = field(default_factory=list)


def with_nav2_parameters(tree: MappingNode, library: Library) -> ExpandedTree:
    """Return the tree of a scenario or stack file with the parameters of its Nav2 files in all sections `stack`.

    The texts of the Nav2 files are added to `library`.
    """
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
    """Return a scenario, or a robot under `robots`, with an expanded `stack`. Add problems and notes to `result`."""
    stack = child(tree, STACK)
    if not isinstance(tree, MappingNode) or not isinstance(stack, MappingNode) or NAV2_PARAMS not in stack.entries:
        return tree
    expanded = _merge_parameters(stack, library, result)
    return MappingNode(tree.position, {**tree.entries, STACK: Entry(tree.entries[STACK].key, expanded)})


def _merge_parameters(stack: MappingNode, library: Library, result: ExpandedTree) -> MappingNode:
    """Return a section `stack` with the parameters of its Nav2 file, and with Nav2's defaults (`profile: nav2`).

    Values in the section itself have priority. Add problems and notes to `result`.
    """
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
    translations = [_with_valid_frequency(each, clock) for each in translate(parameters.nodes, _known_parameters())]
    merged = profile
    for translation in translations:
        if translation.keys:
            merged = merge_mappings(merged, _translated_tree(translation, parameters))
    result.notes += sorted({*parameters.notes, *_notes(translations, parameters)})
    return merge_mappings(stack, merged)


def _clock(scenario: MappingNode) -> Clock:
    """Return a clock with the tick rate of a scenario, or with the default rate if its `physics` is invalid."""
    from simscen.model.scenario import Physics

    physics = child(scenario, "physics")
    try:
        return Clock(Physics.model_validate(physics.plain if physics else {}).tick_rate)
    except ValidationError:
        return Clock()  # validation reports the error


def _with_valid_frequency(translation: Translation, clock: Clock) -> Translation:
    """Return the translation. A controller frequency is replaced by the nearest one with a period of whole ticks."""
    if (
        translation.keys != ("controller_frequency",)
        or not isinstance(translation.value, int | float)
        or translation.value <= 0
    ):
        return translation
    try:
        clock.period(translation.value)
    except ValueError as error:
        hint = "the nearest is used; write `stack: {controller_frequency: …}` in the scenario for another one"
        return replace(translation, value=clock.nearest_rate(translation.value), note=str(error), hint=hint)
    return translation


def _translated_tree(translation: Translation, parameters: Nav2Parameters) -> MappingNode:
    """Return the YAML tree of a section `stack` with one parameter. All nodes have the position of the parameter."""
    position = parameters.positions[translation.node, translation.parameter]
    node: Node = _parameter_node(translation.value, position)
    for key in reversed(translation.keys):
        node = MappingNode(position, {key: Entry(position, node)})
    assert isinstance(node, MappingNode)
    return node


def _parameter_node(value: Any, position: Position) -> Node:
    """Return the YAML node of a value. All its nodes have this position."""
    if isinstance(value, list):
        return SequenceNode(position, tuple(_parameter_node(item, position) for item in value))
    return ScalarNode(position, value)


def _notes(translations: Sequence[Translation], parameters: Nav2Parameters) -> Iterator[Problem]:
    """Yield warnings about ignored and changed parameters, and about unknown nodes.

    Each parameter with a note has its own warning. Other ignored parameters share one warning for each node.
    """
    for translation in translations:
        if translation.note:
            yield ignored_note(
                parameters.positions[translation.node, translation.parameter],
                f"{translation.node}: `{translation.parameter}`: {translation.note}",
                translation.hint,
            )
    used = {
        parameters.positions[translation.node, translation.parameter]
        for translation in translations
        if translation.keys
    }
    for node in parameters.nodes:
        positions = [
            (parameters.positions[node, translation.parameter], translation.parameter)
            for translation in translations
            if translation.node == node
            and not translation.keys
            and not translation.note
            and parameters.positions[node, translation.parameter]
            not in used  # parameters of `/**` may be used by another node
        ]
        if positions:
            names = ", ".join(f"{name} ({position.line})" for position, name in sorted(positions))
            yield ignored_note(min(positions)[0], f"{node}: simscen has no {names}")
    for node in unknown_nodes(parameters.nodes):
        node_positions = [position for (name, _), position in parameters.positions.items() if name == node]
        yield ignored_note(min(node_positions), f"simscen has no node like {node}")


def _known_parameters() -> KnownParameters:
    """Return the names of the parameters of the reference stack, by section or type."""
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
    return {name: tuple(_field_names(model)) for name, model in models.items()}


def _field_names(model: type[BaseModel]) -> Iterator[str]:
    """Yield the names of the fields of a model, and `field.part` for the fields of nested models."""
    for name, model_field in model.model_fields.items():
        yield name
        if isinstance(model_field.annotation, type) and issubclass(model_field.annotation, BaseModel):
            yield from (f"{name}.{part}" for part in model_field.annotation.model_fields)
