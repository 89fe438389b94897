"""Stack that the command line selects for all scenarios with `--stack`."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from simscen.core.errors import Problem
from simscen.core.external_command import ExternalCommand
from simscen.loading.yaml.tree import Entry, MappingNode, Node, Position, ScalarNode, child

SCENARIO_KEYS = ("keepout", "keepout_mask", "speed_zones", "speed_mask")
"""Keys of a `stack:` section that describe the world; they are kept whichever stack is selected."""
COMMON_STACK_KEYS = ("controller_frequency",)
"""Keys that all types of stacks have."""
GOAL_CHECKER, TOLERANCES = "goal_checker", ("xy_goal_tolerance", "yaw_goal_tolerance")
REFERENCE, EXTERNAL = "reference", "external"


@dataclass(frozen=True)
class StackChoice:
    """Stack given as `--stack NAME=VALUE`: a stack file, a type of stack, or the command of an external stack.

    `section` is the `stack:` section of the stack file `file`. `texts` and `files` are those of the stack file and the
    files it extends (see Library); `notes` are warnings about them. `external_command` starts an external stack.
    """

    name: str
    value: str
    type: str = ""
    file: Path | None = None
    section: MappingNode | None = field(default=None, repr=False)
    texts: Mapping[str, str] = field(default_factory=dict, repr=False)
    files: Mapping[str, Path] = field(default_factory=dict, repr=False)
    external_command: ExternalCommand | None = field(default=None, repr=False)
    notes: tuple[Problem, ...] = field(default=(), repr=False)

    @property
    def written(self) -> str:
        """The option as given: NAME=VALUE."""
        return f"{self.name}={self.value}"

    def relative_to_folder(self, folder: Path) -> str:
        """Return NAME=VALUE for a command called in `folder`; a file outside of it is absolute."""
        if self.file is None:
            return self.written
        file = self.file.relative_to(folder).as_posix() if self.file.is_relative_to(folder) else str(self.file)
        return f"{self.name}={file}"


def replace_stack(tree: MappingNode, choice: StackChoice) -> MappingNode:
    """Return a scenario with the selected stack instead of its own.

    Zones, masks and goal tolerances of the scenario are kept. A stack file replaces all other parameters. A command or
    a type of stack has no parameters: those of the scenario are kept if its own stack is of the same kind, else only
    those that all stacks have.
    """
    own = child(tree, "stack")
    if own is not None and not isinstance(own, MappingNode):
        return tree  # validation reports the wrong type
    own = own or MappingNode(tree.position, {})
    if choice.section is None and stack_type(own) == choice.type:
        return tree
    key = tree.entries["stack"].key if "stack" in tree.entries else tree.position
    return MappingNode(tree.position, {**tree.entries, "stack": Entry(key, _section(own, choice))})


def _section(own: MappingNode, choice: StackChoice) -> MappingNode:
    scenario_entries = {name: own.entries[name] for name in SCENARIO_KEYS if name in own.entries}
    if choice.section is not None:
        return _with_goal_tolerances(
            MappingNode(choice.section.position, {**choice.section.entries, **scenario_entries}), own
        )
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
    """Return the section with the goal tolerances of the scenario, so that all stacks are judged by the same ones."""
    checker, below = child(own, GOAL_CHECKER), child(section, GOAL_CHECKER)
    if not isinstance(checker, MappingNode) or not isinstance(below, MappingNode | None):
        return section
    tolerances = {name: checker.entries[name] for name in TOLERANCES if name in checker.entries}
    if not tolerances:
        return section
    whole = MappingNode(checker.position, {**(below.entries if below else {}), **tolerances})
    return MappingNode(section.position, {**section.entries, GOAL_CHECKER: Entry(own.entries[GOAL_CHECKER].key, whole)})


def stack_type(section: Node) -> str | None:
    """Return the type of a `stack:` section; None for an external stack or an invalid type."""
    if child(section, EXTERNAL) is not None:
        return None
    written = child(section, "type")
    return REFERENCE if written is None else written.value if isinstance(written, ScalarNode) else None  # type: ignore[return-value]
