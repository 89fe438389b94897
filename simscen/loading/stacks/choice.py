"""Choice of a stack for all scenarios by `--stack`, and stack files (`*.stack.yaml` or Nav2 parameter files)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from simscen.core.errors import InvalidInput, Problem
from simscen.core.external_command import ExternalCommand
from simscen.loading.files.paths import PathSandbox, path_in_messages
from simscen.loading.schema.validate import check
from simscen.loading.stacks.nav2_expansion import NAV2_PARAMS, with_nav2_parameters
from simscen.loading.stacks.nav2_parameters import is_nav2_parameter_file
from simscen.loading.yaml.library import Library
from simscen.loading.yaml.textfile import read_text
from simscen.loading.yaml.tree import Entry, MappingNode, Node, Position, ScalarNode, child, entries_of
from simscen.model.stack_files import StackFileSpec

SCENARIO_KEYS = ("keepout", "keepout_mask", "speed_zones", "speed_mask")
"""Keys under `stack` for zones and masks. Their values belong to the scenario, and apply to every stack."""
COMMON_STACK_KEYS = ("controller_frequency",)
"""Keys under `stack` that are valid for all types of stacks."""
GOAL_CHECKER = "goal_checker"
"""Key under `stack` with the goal tolerances."""
TOLERANCES = ("xy_goal_tolerance", "yaw_goal_tolerance")
"""Keys of the goal tolerances under `goal_checker`."""
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
    def written(self) -> str:
        """NAME=VALUE as on the command line."""
        return f"{self.name}={self.value}"

    def relative_to_folder(self, folder: Path) -> str:
        """Return NAME=VALUE with the path of a stack file relative to `folder`, or absolute if it is outside."""
        return self.written if self.file is None else f"{self.name}={path_in_messages(self.file, folder)}"


def replace_stack(tree: MappingNode, choice: StackChoice) -> MappingNode:
    """Return a scenario tree of one robot with the selected stack.

    Zones, masks, and goal tolerances of the scenario are kept. A stack file replaces all other parameters. A type or a
    command leaves them unchanged if the scenario's stack has this type; otherwise, it keeps only COMMON_STACK_KEYS.
    """
    own = child(tree, "stack")
    if own is not None and not isinstance(own, MappingNode):
        return tree  # validation reports the wrong type
    own = own or MappingNode(tree.position, {})
    if choice.section is None and _has_type(own, choice.type):
        return tree
    return tree.with_value(("stack",), _replaced_section(own, choice), tree.position)


def _replaced_section(own: MappingNode, choice: StackChoice) -> MappingNode:
    """Return the section `stack` of the choice, with the values of the scenario's section `own` that are kept."""
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


def _has_type(section: MappingNode, stack_type: str) -> bool:
    """Return whether a section `stack` selects this type of stack; False for an external stack."""
    written = child(section, "type")
    selected = REFERENCE if written is None else written.plain
    return EXTERNAL not in section.entries and selected == stack_type


def load_stack_file(name: str, value: str, path: Path, root: Path, world_path: Sequence[Path] = ()) -> StackChoice:
    """Return the choice `--stack name=value` of the stack file `path`, which may be outside `root`.

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
    """Return the section `stack` of a stack file and warnings about the file; or all problems of the file.

    `path` can also be a Nav2 parameter file. In the section, the path of each Nav2 file is replaced by the parameters
    in this file.
    """
    file = library.sandbox.resolve_argument(path)
    if isinstance(file, Problem):
        return [file]
    tree, problems = _read_tree(file, library)
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
    problems = spec if isinstance(spec, list) else []
    for name in SCENARIO_KEYS:
        if (entry := entries_of(section).get(name)) is not None:
            message = f"`{name}` belongs to a scenario, not to a stack file"
            hint = "write it under `stack:` of the scenario, where it applies to every stack"
            problems.append(Problem(*entry.key, "SC016", message, hint))
    if problems or not isinstance(section, MappingNode):
        return library.with_source(sorted(problems))
    return section.without_keys(NAV2_PARAMS), notes


def _read_tree(file: Path, library: Library) -> tuple[Node | None, list[Problem]]:
    """Return the YAML tree and problems of a stack file. For a Nav2 file, the tree is `stack: {nav2_params: FILE}`."""
    display_name = library.sandbox.display_name(file)
    text = read_text(file, display_name)
    if isinstance(text, Problem) or not is_nav2_parameter_file(text, display_name):
        return library.read(file)
    library.add({display_name: text}, {display_name: file})
    start = Position(display_name, 1, 1)
    stack = MappingNode(start, {NAV2_PARAMS: Entry(start, ScalarNode(start, file.name))})
    entries = {"simscen": Entry(start, ScalarNode(start, 1)), "stack": Entry(start, stack)}
    return MappingNode(start, entries), []


STACK_FILE_KIND, NAV2_FILE_KIND = "stack file", "parameter file of Nav2"
"""Kinds of files with the parameters of a stack, as in messages."""
_STACK_FILE_KEYS = frozenset({"simscen", "name", "description", "stack"})
"""Top-level keys that a stack file can have."""


def recognize_stack_file(tree: Node | None, text: str, display_name: str) -> str:
    """Recognize a stack file by its content: return STACK_FILE_KIND, NAV2_FILE_KIND, or "" for other files.

    `tree` and `text` are the content of the file, and `display_name` is its path in messages.
    """
    if is_nav2_parameter_file(text, display_name):
        return NAV2_FILE_KIND
    keys = entries_of(tree).keys()
    return STACK_FILE_KIND if "stack" in keys and keys <= _STACK_FILE_KEYS else ""


def not_a_scenario(kind: str, display_name: str) -> Problem:
    """Return the problem that a stack file is used as a scenario. `kind` is STACK_FILE_KIND or NAV2_FILE_KIND."""
    alternative = f", or name it in a scenario: `stack: {{nav2_params: {display_name.rpartition('/')[2]}}}`"
    hint = f"run scenarios with `--stack NAME={display_name}`{alternative if kind == NAV2_FILE_KIND else ''}"
    return Problem(display_name, 0, 0, "SC025", f"this is a {kind}, not a scenario", hint)
