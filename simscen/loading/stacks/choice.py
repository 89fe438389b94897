"""A stack that the command line chooses for every scenario, in place of the scenario's own."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from simscen.core.errors import Problem
from simscen.core.external_command import ExternalCommand
from simscen.loading.yaml.tree import Entry, MappingNode, Node, Position, ScalarNode, child

SCENARIO_KEYS = ("keepout", "keepout_mask", "speed_zones", "speed_mask")
"""What of a `stack:` section is about the world rather than the stack: it stays, whichever stack drives there."""
COMMON_STACK_KEYS = ("controller_frequency",)
"""What a scenario may ask of a stack of any kind."""
CHECKER, TOLERANCES = "goal_checker", ("xy_goal_tolerance", "yaw_goal_tolerance")
REFERENCE, EXTERNAL = "reference", "external"


@dataclass(frozen=True)
class StackChoice:
    """What `--stack NAME=VALUE` means; `value` is as it was given.

    `file` is the stack file that it names, `section` the `stack:` of that; `type` is the type of stack that it names;
    `runs` is the command that it is. `texts` and `files` are those of the stack file and what it extends (Library),
    `notes` what of them means nothing.
    """

    name: str
    value: str
    type: str = ""
    file: Path | None = None
    section: MappingNode | None = field(default=None, repr=False)
    texts: Mapping[str, str] = field(default_factory=dict, repr=False)
    files: Mapping[str, Path] = field(default_factory=dict, repr=False)
    runs: ExternalCommand | None = field(default=None, repr=False)
    notes: tuple[Problem, ...] = field(default=(), repr=False)

    @property
    def written(self) -> str:
        """NAME=VALUE."""
        return f"{self.name}={self.value}"

    def seen_from(self, folder: Path) -> str:
        """NAME=VALUE, for a command that is called in another folder; what is not below it is absolute."""
        if self.file is None:
            return self.written
        file = self.file.relative_to(folder).as_posix() if self.file.is_relative_to(folder) else str(self.file)
        return f"{self.name}={file}"


def replace_stack(tree: MappingNode, choice: StackChoice) -> MappingNode:
    """A scenario with the chosen stack in place of its own.

    Its zones and masks stay, and how near to a goal is near enough. A command or a type of stack says nothing of
    parameters: those of the scenario's own stack stay where it is of the same kind, else those that any stack has. A
    file says all of them.
    """
    own = child(tree, "stack")
    if own is not None and not isinstance(own, MappingNode):
        return tree  # which is a mistake that is told as such
    own = own or MappingNode(tree.place, {})
    if choice.section is None and stack_type(own) == choice.type:
        return tree
    key = tree.entries["stack"].key if "stack" in tree.entries else tree.place
    return MappingNode(tree.place, {**tree.entries, "stack": Entry(key, _section(own, choice))})


def _section(own: MappingNode, choice: StackChoice) -> MappingNode:
    kept = {name: own.entries[name] for name in SCENARIO_KEYS if name in own.entries}
    if choice.section is not None:
        return _asked(MappingNode(choice.section.place, {**choice.section.entries, **kept}), own)
    place = Position(f"--stack {choice.written}", 0, 0)
    if choice.runs is not None:
        named = {EXTERNAL: Entry(place, ScalarNode(place, choice.name))}
        if child(own, EXTERNAL) is not None:
            return MappingNode(own.place, {**own.entries, **named})
    else:
        named = {"type": Entry(place, ScalarNode(place, choice.type))}
    rate = {name: own.entries[name] for name in COMMON_STACK_KEYS if name in own.entries}
    return _asked(MappingNode(place, {**named, **rate, **kept}), own)


def _asked(section: MappingNode, own: MappingNode) -> MappingNode:
    """The section with the tolerances of goals that the scenario asks for: every stack is judged by them."""
    checker, below = child(own, CHECKER), child(section, CHECKER)
    if not isinstance(checker, MappingNode) or not isinstance(below, MappingNode | None):
        return section
    asked = {name: checker.entries[name] for name in TOLERANCES if name in checker.entries}
    if not asked:
        return section
    whole = MappingNode(checker.place, {**(below.entries if below else {}), **asked})
    return MappingNode(section.place, {**section.entries, CHECKER: Entry(own.entries[CHECKER].key, whole)})


def stack_type(section: Node) -> str | None:
    """The type of stack of a `stack:` section, as far as it has a plain one; an external one has none."""
    if child(section, EXTERNAL) is not None:
        return None
    written = child(section, "type")
    return REFERENCE if written is None else written.value if isinstance(written, ScalarNode) else None  # type: ignore[return-value]
