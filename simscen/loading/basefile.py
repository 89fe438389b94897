"""Files that are there to be extended: `*.base.yaml`, and the `defaults.yaml` beside scenarios."""

from pathlib import Path

from simscen.core.problems import Problem
from simscen.loading.assets import Assets
from simscen.loading.document import MORE, Library
from simscen.loading.tree import Fields, Leaf, Node, at, child, value_place
from simscen.loading.validation import check_partial
from simscen.model.scenario import ScenarioSpec


def problems_of_base(file: Path, library: Library) -> list[Problem]:
    """What is wrong with what a partial scenario says, and with the files that it names.

    What it leaves out is for the scenarios to say that extend it.
    """
    tree, problems = library.read(file)
    if problems or tree is None:
        return library.with_source(problems)
    problems = check_partial(ScenarioSpec, _with_lists(tree))
    return library.with_source(sorted([*problems, *(_of_files(tree, library) if isinstance(tree, Fields) else [])]))


def _with_lists(tree: Node) -> Node:
    """The same with `pass+` as `pass`: what is to be added must be what may stand there."""
    if not isinstance(tree, Fields):
        return tree
    entries = {key.removesuffix(MORE): entry for key, entry in tree.entries.items() if key.endswith(MORE)}
    return Fields(tree.place, {**entries, **{key: entry for key, entry in tree.entries.items() if key[-1:] != MORE}})


def _of_files(tree: Fields, library: Library) -> list[Problem]:
    assets = Assets(library)
    world, model = child(tree, "world"), at(tree, ("robot", "model"))
    if isinstance(world, Leaf) and isinstance(world.value, str):
        assets.world(world)
    if isinstance(model, Leaf) and isinstance(model.value, str):
        assets.robot(model.value, value_place(tree, ("robot", "model")))
    return assets.problems
