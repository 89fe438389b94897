"""Choice of a stack for all scenarios by `--stack`."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from simscen.core.errors import Problem
from simscen.core.external_command import ExternalCommand
from simscen.loading.files.paths import path_in_messages
from simscen.loading.yaml.tree import Entry, MappingNode, Position, ScalarNode, child

SCENARIO_KEYS = ("keepout", "keepout_mask", "speed_zones", "speed_mask")
"""Keys under `stack` for zones and masks. Their values belong to the scenario, and apply to every stack."""
COMMON_STACK_KEYS = ("controller_frequency",)
"""Keys under `stack` that are valid for all types of stacks."""
GOAL_CHECKER = "goal_checker"
"""Key under `stack` with the goal tolerances."""
TOLERANCES = ("xy_goal_tolerance", "yaw_goal_tolerance")
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

    @property
    def written(self) -> str:
        """NAME=VALUE as on the command line."""
        return f"{self.name}={self.value}"

    def relative_to_folder(self, folder: Path) -> str:
        """Return NAME=VALUE with the path of a stack file relative to `folder`, or absolute if it is outside."""
        return self.written if self.file is None else f"{self.name}={path_in_messages(self.file, folder)}"


def replace_stack(tree: MappingNode, choice: StackChoice) -> MappingNode:
    """Return a scenario tree of one robot with the selected stack.

    Zones, masks, and goal tolerances of the scenario are kept. A stack file replaces all other parameters. A type
    of stack keeps them if the scenario has this type, and a command keeps them if the scenario's stack is external;
    otherwise, both keep only COMMON_STACK_KEYS.
    """
    own = child(tree, "stack")
    if own is not None and not isinstance(own, MappingNode):
        return tree  # validation reports the wrong type
    own = own or MappingNode(tree.position, {})
    written = child(own, "type")
    own_type = "" if EXTERNAL in own.entries else REFERENCE if written is None else written.plain
    if choice.section is None and choice.type and own_type == choice.type:
        return tree
    return tree.with_value(("stack",), _replaced_section(own, choice), tree.position)


def _replaced_section(own: MappingNode, choice: StackChoice) -> MappingNode:
    """Return the section `stack` of the choice, with the values of the scenario's section `own` that are kept."""
    scenario_entries = {name: own.entries[name] for name in SCENARIO_KEYS if name in own.entries}
    if choice.section is not None:
        entries = {**choice.section.entries, **scenario_entries}
        return _with_goal_tolerances(MappingNode(choice.section.position, entries), own)
    position = Position(f"--stack {choice.written}", 0, 0)
    if choice.external_command is not None:
        named = {EXTERNAL: Entry(position, ScalarNode(position, choice.name))}
        if child(own, EXTERNAL) is not None:
            return MappingNode(own.position, {**own.entries, **named})
    else:
        named = {"type": Entry(position, ScalarNode(position, choice.type))}
    rate = {name: own.entries[name] for name in COMMON_STACK_KEYS if name in own.entries}
    return _with_goal_tolerances(MappingNode(position, {**named, **rate, **scenario_entries}), own)


def _with_goal_tolerances(section: MappingNode, own: MappingNode) -> MappingNode:
    """Return the section `stack` with the goal tolerances of the section `own` of the scenario."""
    checker, replaced = child(own, GOAL_CHECKER), child(section, GOAL_CHECKER)
    if not isinstance(checker, MappingNode) or not isinstance(replaced, MappingNode | None):
        return section
    tolerances = {name: checker.entries[name] for name in TOLERANCES if name in checker.entries}
    if not tolerances:
        return section
    merged = MappingNode(checker.position, {**(replaced.entries if replaced else {}), **tolerances})
    entry = Entry(own.entries[GOAL_CHECKER].key, merged)
    return MappingNode(section.position, {**section.entries, GOAL_CHECKER: entry})
