"""Reads files with the parameters of a stack: `*.stack.yaml` files and Nav2 parameter files."""

from collections.abc import Sequence
from pathlib import Path

from simscen.core.errors import InvalidInput, Problem
from simscen.loading.files.paths import PathSandbox
from simscen.loading.schema.validate import check
from simscen.loading.stacks.choice import SCENARIO_KEYS, StackChoice
from simscen.loading.stacks.nav2_expansion import NAV2_PARAMS, with_nav2_parameters
from simscen.loading.stacks.nav2_parameters import is_nav2_parameter_file
from simscen.loading.yaml.library import Library
from simscen.loading.yaml.textfile import read_text
from simscen.loading.yaml.tree import Entry, MappingNode, Node, Position, ScalarNode, child, entries_of
from simscen.model.stack_files import StackFileSpec


def load_stack_file(name: str, value: str, path: Path, root: Path, world_path: Sequence[Path] = ()) -> StackChoice:
    """Return the choice `--stack name=value` of the stack file `path`. Raises InvalidInput with all its problems."""
    library = Library(PathSandbox.around(root, [*world_path, path.parent]))
    found = read_stack_file(path, library)
    if isinstance(found, list):
        raise InvalidInput(found)
    section, notes = found
    texts, files = dict(library.texts), dict(library.files)
    return StackChoice(name, value, "", path.absolute(), section, texts, files, notes=tuple(notes))


def read_stack_file(path: Path, library: Library) -> tuple[MappingNode, list[Problem]] | list[Problem]:
    """Return the section `stack` of a stack file or Nav2 parameter file, and warnings; or all problems of the file.

    The section includes the parameters of the Nav2 file that a stack file names.
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
    """Return the YAML tree and all problems of a stack file.

    A Nav2 parameter file is treated as a stack file with `stack: {nav2_params: FILE}`.
    """
    display_name = library.sandbox.display_name(file)
    text = read_text(file, display_name)
    if isinstance(text, Problem) or not is_nav2_parameter_file(text, display_name):
        return library.read(file)
    library.add({display_name: text}, {display_name: file})
    start = Position(display_name, 1, 1)
    stack = MappingNode(start, {NAV2_PARAMS: Entry(start, ScalarNode(start, file.name))})
    entries = {"simscen": Entry(start, ScalarNode(start, 1)), "stack": Entry(start, stack)}
    return MappingNode(start, entries), []
