"""Selection of a stack for all scenarios by the option `--stack NAME=VALUE`."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from simscen.core.errors import Problem
from simscen.core.external_command import ExternalCommand
from simscen.loading.files.paths import path_in_messages
from simscen.loading.yaml.tree import Entry, MappingNode, Position, ScalarNode, child

SCENARIO_KEYS = ("keepout", "keepout_mask", "speed_zones", "speed_mask")
"""Keys under `stack` for zones and masks. These belong to the scenario, and apply to every stack."""
COMMON_STACK_KEYS = ("controller_frequency",)
"""Keys under `stack` that are valid for all types of stacks."""
GOAL_CHECKER = "goal_checker"
"""Key under `stack` with the goal tolerances."""
TOLERANCES = ("xy_goal_tolerance", "yaw_goal_tolerance")
"""Keys of the goal tolerances under GOAL_CHECKER."""
EXTERNAL = "external"
"""Key under `stack` with the name of an external stack."""
REFERENCE = "reference"
"""Default type of a stack."""


@dataclass(frozen=True)
class StackChoice:
    """Stack in the option `--stack NAME=VALUE`. VALUE is a stack file, a type of stack, or a command."""

    name: str
    value: str
    type: str = ""
    """Type of the stack, e.g. "reference"; "" for a stack file or a command."""
    file: Path | None = None
    """Stack file; None if VALUE is no file."""
    section: MappingNode | None = field(default=None, repr=False)
    """YAML tree of the section `stack` in the stack file; None without a stack file."""
    texts: Mapping[str, str] = field(default_factory=dict, repr=False)
    """Texts of the stack file and of the files that it extends, by path as in messages."""
    files: Mapping[str, Path] = field(default_factory=dict, repr=False)
    """Absolute paths of the same files, by path as in messages."""
    external_command: ExternalCommand | None = field(default=None, repr=False)
    """Command that starts an external stack; None if VALUE is no command."""
    notes: tuple[Problem, ...] = field(default=(), repr=False)
    """Warnings about the stack file."""

    @property
    def option_text(self) -> str:
        """NAME=VALUE as on the command line."""
        return f"{self.name}={self.value}"

    def relative_to_folder(self, folder: Path) -> str:
        """Return NAME=VALUE with the path of a stack file relative to `folder`, or absolute if it is outside."""
        return self.option_text if self.file is None else f"{self.name}={path_in_messages(self.file, folder)}"


def replace_stack(tree: MappingNode, choice: StackChoice) -> MappingNode:
    """Return a scenario tree of one robot with the selected stack.

    Zones, masks, and goal tolerances of the scenario are kept. The other parameters of the scenario's stack are kept
    - if `choice` is a type of stack, and the scenario's stack has this type
    - if `choice` is a command, and the scenario's stack is external.
    Otherwise, a stack file replaces all other parameters. A type or a command keeps only COMMON_STACK_KEYS.
    """
    section = child(tree, "stack")
    if section is not None and not isinstance(section, MappingNode):
        return tree  # validation reports the wrong type
    section = section or MappingNode(tree.position, {})
    type_node = child(section, "type")
    type_name = "" if EXTERNAL in section.entries else REFERENCE if type_node is None else type_node.plain
    if choice.section is None and choice.type and type_name == choice.type:
        return tree
    return tree.with_value(("stack",), _replaced_section(section, choice), tree.position)


def _replaced_section(old: MappingNode, choice: StackChoice) -> MappingNode:
    """Return the section `stack` of the choice, with the values of the scenario's section `old` that are kept."""
    scenario_entries = {name: old.entries[name] for name in SCENARIO_KEYS if name in old.entries}
    if choice.section is not None:
        entries = {**choice.section.entries, **scenario_entries}
        return _with_goal_tolerances(MappingNode(choice.section.position, entries), old)
    position = Position(f"--stack {choice.option_text}", 0, 0)
    if choice.external_command is not None:
        selection = {EXTERNAL: Entry(position, ScalarNode(position, choice.name))}
        if child(old, EXTERNAL) is not None:
            return MappingNode(old.position, {**old.entries, **selection})
    else:
        selection = {"type": Entry(position, ScalarNode(position, choice.type))}
    common_entries = {name: old.entries[name] for name in COMMON_STACK_KEYS if name in old.entries}
    return _with_goal_tolerances(MappingNode(position, {**selection, **common_entries, **scenario_entries}), old)


def _with_goal_tolerances(section: MappingNode, old: MappingNode) -> MappingNode:
    """Return the section `stack` with the goal tolerances of the scenario's section `old`."""
    old_checker, checker = child(old, GOAL_CHECKER), child(section, GOAL_CHECKER)
    if not isinstance(old_checker, MappingNode) or not isinstance(checker, MappingNode | None):
        return section
    tolerances = {name: old_checker.entries[name] for name in TOLERANCES if name in old_checker.entries}
    if not tolerances:
        return section
    merged = MappingNode(old_checker.position, {**(checker.entries if checker else {}), **tolerances})
    entry = Entry(old.entries[GOAL_CHECKER].key, merged)
    return MappingNode(section.position, {**section.entries, GOAL_CHECKER: entry})
