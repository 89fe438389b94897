"""Expands `stack: {nav2_params: FILE}`: adds the translated parameters of the Nav2 file to the section `stack`."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from pydantic import ValidationError

from simscen.core.clock import Clock
from simscen.core.errors import Problem
from simscen.loading.stacks.nav2_mapping import Translation
from simscen.loading.stacks.nav2_nodes import is_unknown, translate
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
    entries_of,
    existing_keys,
    node_at,
    value_position,
)

NAV2_PARAMS, STACK, ROBOTS = "nav2_params", "stack", "robots"
"""Keys of a scenario and of the section `stack`."""


@dataclass
class ExpandedTree:
    """YAML tree with the parameters of its Nav2 files, errors in these files (`problems`), and warnings (`notes`)."""

    tree: MappingNode
    problems: list[Problem] = field(default_factory=list)
    notes: list[Problem] = field(default_factory=list)


def with_nav2_parameters(tree: MappingNode, library: Library) -> ExpandedTree:
    """Return a scenario or stack tree with the parameters of its Nav2 files. The texts are added to `library`."""
    result = ExpandedTree(tree)
    for keys in (*((ROBOTS, name, STACK) for name in entries_of(child(tree, ROBOTS))), (STACK,)):
        stack = node_at(tree, keys)
        if existing_keys(tree, keys) == keys and isinstance(stack, MappingNode) and NAV2_PARAMS in stack.entries:
            result.tree = result.tree.with_value(keys, _merge_parameters(stack, library, result), stack.position)
    return result


def _merge_parameters(stack: MappingNode, library: Library, result: ExpandedTree) -> MappingNode:
    """Return a section `stack` with the parameters of its Nav2 file and of the profile `nav2`.

    Problems and notes are added to `result`.
    """
    path_node, position = stack.entries[NAV2_PARAMS].value, value_position(stack, (NAV2_PARAMS,))
    if not isinstance(path_node, ScalarNode) or not isinstance(path_node.value, str):
        return stack  # validation reports the wrong type
    file = library.find(path_node.value, position)
    if isinstance(file, Problem):
        result.problems.append(file)
        return stack
    display_name = library.sandbox.display_name(file)
    parameters = read_nav2_parameters(file, display_name)
    if not isinstance(parameters, Nav2Parameters):
        result.problems += parameters
        return stack
    library.add({display_name: parameters.text}, {display_name: file})
    merged = MappingNode(position, {"profile": Entry(position, ScalarNode(position, "nav2"))})
    clock = _clock(result.tree)
    translations = {
        node: [_with_valid_frequency(translation, clock) for translation in translate(node, values)]
        for node, values in parameters.nodes.items()
    }
    for node, node_translations in translations.items():
        for translation in node_translations:
            if translation.keys:
                source = parameters.positions[node, translation.parameter]
                value = _parameter_node(translation.value, source)
                merged = merge_mappings(merged, MappingNode(source, {}).with_value(translation.keys, value, source))
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
    """Return the translation. A controller frequency is replaced by the nearest one with a whole number of ticks."""
    is_number = isinstance(translation.value, int | float) and 0 < translation.value < math.inf
    if translation.keys != ("controller_frequency",) or not is_number:
        return translation  # validation reports other values
    try:
        clock.period(translation.value)
    except ValueError as error:
        hint = "the nearest rate is used; to use another rate, set `stack: {controller_frequency: …}` in the scenario"
        return replace(translation, value=clock.nearest_rate(translation.value), note=str(error), hint=hint)
    return translation


def _parameter_node(value: Any, position: Position) -> Node:
    """Return the YAML node of a value. All its nodes have this position."""
    if isinstance(value, list):
        return SequenceNode(position, tuple(_parameter_node(item, position) for item in value))
    return ScalarNode(position, value)


def _notes(translations: Mapping[str, list[Translation]], parameters: Nav2Parameters) -> Iterator[Problem]:
    """Yield warnings about changed and ignored parameters, and about nodes without a counterpart."""
    used_positions = {
        parameters.positions[node, translation.parameter]
        for node, node_translations in translations.items()
        for translation in node_translations
        if translation.keys
    }
    for node, node_translations in translations.items():
        ignored = []
        for translation in node_translations:
            position = parameters.positions[node, translation.parameter]
            if translation.note:
                yield ignored_note(position, f"{node}: `{translation.parameter}`: {translation.note}", translation.hint)
            elif position not in used_positions:  # another node may use a parameter of `/**`
                ignored.append((position, translation.parameter))
        if ignored:
            names = ", ".join(f"{name} ({position.line})" for position, name in sorted(ignored))
            yield ignored_note(min(ignored)[0], f"{node}: simscen has no {names}")
        if is_unknown(node, parameters.nodes[node]):
            positions = [position for (name, _), position in parameters.positions.items() if name == node]
            yield ignored_note(min(positions), f"simscen has no node like {node}")
