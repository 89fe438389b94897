"""Read a `*.stack.yaml`: the parameters of a stack, for every scenario that is run with it."""

from collections.abc import Sequence
from pathlib import Path

from simscen.core.errors import InvalidInput
from simscen.core.problems import Problem
from simscen.loading.document import Library
from simscen.loading.nav2params import tells_nodes
from simscen.loading.nav2stack import KEY as NAV2_PARAMS
from simscen.loading.nav2stack import with_nav2_parameters
from simscen.loading.paths import Fence
from simscen.loading.source import read_text
from simscen.loading.stackchoice import OF_THE_SCENARIO, StackChoice
from simscen.loading.tree import Entry, Fields, Leaf, Node, Place, child, key_place
from simscen.loading.validation import check
from simscen.model.stackfile import StackFileSpec


def load_stack_file(name: str, value: str, path: Path, root: Path, world_path: Sequence[Path] = ()) -> StackChoice:
    """The stack in `path`, which may lie outside `root`: whoever calls the command chooses it.

    Raises InvalidInput with all that is wrong with it.
    """
    library = Library(Fence.around(root, [*world_path, path.parent]))
    found = stack_file(path, library)
    if isinstance(found, list):
        raise InvalidInput(found)
    section, notes = found
    return StackChoice(
        name, value, "", path.absolute(), section, dict(library.texts), dict(library.files), notes=tuple(notes)
    )


def stack_file(path: Path, library: Library) -> tuple[Fields, list[Problem]] | list[Problem]:
    """The `stack:` section of a stack file and what of it means nothing, or all that is wrong with the file.

    A parameter file of Nav2 is taken for a stack file that names it.

    What a parameter file of Nav2 says is part of the section, which names that file no more: it may lie where no
    scenario can reach it.
    """
    file = library.fence.entered(path)
    if isinstance(file, Problem):
        return [file]
    tree, problems = _read(file, library)
    if problems or tree is None:
        return library.with_source(problems)
    notes: list[Problem] = []
    if isinstance(tree, Fields):
        taken = with_nav2_parameters(tree, library)
        notes = library.with_source(taken.notes)
        if taken.problems:
            return library.with_source(sorted(taken.problems))
        tree = taken.tree
    spec = check(StackFileSpec, tree)
    section = child(tree, "stack")
    misplaced = _misplaced(section) if isinstance(section, Fields) else []
    if isinstance(spec, list) or misplaced or not isinstance(section, Fields):
        return library.with_source(sorted([*misplaced, *(spec if isinstance(spec, list) else [])]))
    kept = {key: entry for key, entry in section.entries.items() if key != NAV2_PARAMS}
    return Fields(section.place, kept), notes


def _read(file: Path, library: Library) -> tuple[Node | None, list[Problem]]:
    """The tree of a stack file; of a parameter file of Nav2 that of one which names it."""
    shown = library.fence.shown(file)
    text = read_text(file, shown)
    if isinstance(text, Problem) or not tells_nodes(text, shown):
        return library.read(file)
    library.add({shown: text}, {shown: file})
    here = Place(shown, 1, 1)

    def fields(key: str, value: Node) -> dict[str, Entry]:
        return {key: Entry(here, value)}

    stack = Fields(here, fields(NAV2_PARAMS, Leaf(here, file.name)))
    return Fields(here, {**fields("simscen", Leaf(here, 1)), **fields("stack", stack)}), []


def _misplaced(section: Fields) -> list[Problem]:
    """What belongs into a scenario: regions and masks are of a world, and a stack is to drive in many."""
    hint = "write it under `stack:` of the scenario, where it holds for every stack"
    return [
        Problem(*key_place(section, (name,)), "SC016", f"`{name}` is the scenario's, not the stack's", hint)
        for name in OF_THE_SCENARIO
        if name in section.entries
    ]
