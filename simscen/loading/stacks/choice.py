"""Stack that the command line selects for all scenarios with `--stack`, and stack files (`*.stack.yaml`)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from simscen.core.errors import InvalidInput, Problem
from simscen.core.external_command import ExternalCommand
from simscen.loading.files.paths import PathSandbox
from simscen.loading.schema.validate import check
from simscen.loading.stacks.nav2_parameters import NAV2_PARAMS, is_nav2_parameter_file, with_nav2_parameters
from simscen.loading.yaml.library import Library
from simscen.loading.yaml.textfile import read_text
from simscen.loading.yaml.tree import Entry, MappingNode, Node, Position, ScalarNode, child, key_position
from simscen.model.stack_files import StackFileSpec

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


def load_stack_file(name: str, value: str, path: Path, root: Path, world_path: Sequence[Path] = ()) -> StackChoice:
    """Return the stack in `path`, which may be outside `root` because the command line names it.

    Raises InvalidInput with all problems of the file.
    """
    library = Library(PathSandbox.around(root, [*world_path, path.parent]))
    found = read_stack_file(path, library)
    if isinstance(found, list):
        raise InvalidInput(found)
    section, notes = found
    return StackChoice(
        name, value, "", path.absolute(), section, dict(library.texts), dict(library.files), notes=tuple(notes)
    )


def read_stack_file(path: Path, library: Library) -> tuple[MappingNode, list[Problem]] | list[Problem]:
    """Return the `stack:` section of a stack file and warnings about it, or all problems of the file.

    A Nav2 parameter file counts as a stack file with `nav2_params`. The section contains the Nav2 parameters
    instead of the path of their file, which may be outside the root of the scenarios.
    """
    file = library.sandbox.resolve_argument(path)
    if isinstance(file, Problem):
        return [file]
    tree, problems = _read(file, library)
    if problems or tree is None:
        return library.with_source(problems)
    notes: list[Problem] = []
    if isinstance(tree, MappingNode):
        expanded = with_nav2_parameters(tree, library)
        notes = library.with_source(expanded.notes)
        if expanded.problems:
            return library.with_source(sorted(expanded.problems))
        tree = expanded.tree
    spec = check(StackFileSpec, tree)
    section = child(tree, "stack")
    misplaced = _misplaced(section) if isinstance(section, MappingNode) else []
    if isinstance(spec, list) or misplaced or not isinstance(section, MappingNode):
        return library.with_source(sorted([*misplaced, *(spec if isinstance(spec, list) else [])]))
    return section.without_keys(NAV2_PARAMS), notes


def _read(file: Path, library: Library) -> tuple[Node | None, list[Problem]]:
    """Return the tree of a stack file; for a Nav2 parameter file, of a stack file with `nav2_params`."""
    display_name = library.sandbox.display_name(file)
    text = read_text(file, display_name)
    if isinstance(text, Problem) or not is_nav2_parameter_file(text, display_name):
        return library.read(file)
    library.add({display_name: text}, {display_name: file})
    here = Position(display_name, 1, 1)

    def fields(key: str, value: Node) -> dict[str, Entry]:
        return {key: Entry(here, value)}

    stack = MappingNode(here, fields(NAV2_PARAMS, ScalarNode(here, file.name)))
    return MappingNode(here, {**fields("simscen", ScalarNode(here, 1)), **fields("stack", stack)}), []


def _misplaced(section: MappingNode) -> list[Problem]:
    """Return problems with zones and masks, which belong to a scenario because they describe a world."""
    hint = "write it under `stack:` of the scenario, where it applies to every stack"
    return [
        Problem(*key_position(section, (name,)), "SC016", f"`{name}` belongs to a scenario, not to a stack file", hint)
        for name in SCENARIO_KEYS
        if name in section.entries
    ]


STACK_FILE_KIND, NAV2_FILE_KIND = "stack file", "parameter file of Nav2"
_STACK_FILE_KEYS = frozenset({"simscen", "name", "description", "stack"})


def recognize_stack_file(tree: Node | None, text: str, display_name: str) -> str:
    """Return STACK_FILE_KIND or NAV2_FILE_KIND if the file is one of them, else ""."""
    if is_nav2_parameter_file(text, display_name):
        return NAV2_FILE_KIND
    keys = set(tree.entries) if isinstance(tree, MappingNode) else set()
    return STACK_FILE_KIND if "stack" in keys <= _STACK_FILE_KEYS else ""


def not_a_scenario(kind: str, display_name: str) -> Problem:
    """Return the problem that a file of this kind is not a scenario, with a hint how to use it."""
    alternative = f", or name it in a scenario: `stack: {{nav2_params: {display_name.rpartition('/')[2]}}}`"
    hint = f"run scenarios with `--stack NAME={display_name}`{alternative if kind == NAV2_FILE_KIND else ''}"
    return Problem(display_name, 0, 0, "SC025", f"this is a {kind}, not a scenario", hint)
