"""Load a scenario with everything it names, or say all that is wrong with it."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal

from simscen.core.errors import InvalidInput
from simscen.core.problems import Problem
from simscen.loading.assets import Assets
from simscen.loading.consistency import inconsistencies
from simscen.loading.document import Library
from simscen.loading.loaded import LoadedMap, LoadedScenario, LoadedWorld
from simscen.loading.masks import judged_masks
from simscen.loading.paths import Fence
from simscen.loading.placing import placed, places_of, unknown_places
from simscen.loading.stackchoice import StackChoice, with_stack
from simscen.loading.tree import Fields, Key, Leaf, Node, at, child, value_place
from simscen.loading.validation import check
from simscen.model.scenario import ScenarioSpec
from simscen.model.world import WorldSpec

SUFFIXES = (".scenario.yaml", ".scenario.yml", ".yaml", ".yml")


def load_scenario(
    path: Path, root: Path, world_path: Sequence[Path] = (), choice: StackChoice | None = None
) -> LoadedScenario:
    """The scenario in the file `path`; paths in it stay inside `root` and the folders of `world_path`.

    The chosen stack takes the place of its own. Raises InvalidInput with every problem of the scenario and of the files
    it names.
    """
    loaded = try_scenario(path, root, world_path, choice)
    if isinstance(loaded, list):
        raise InvalidInput(loaded)
    return loaded


def try_scenario(
    path: Path, root: Path, world_path: Sequence[Path] = (), choice: StackChoice | None = None
) -> LoadedScenario | list[Problem]:
    """As load_scenario, but returns the problems."""
    fence = Fence.around(root, world_path)
    library = Library(fence)
    file = fence.entered(path)
    if isinstance(file, Problem):
        return [file]
    if unusable_name(name := scenario_id(file, fence.root).rpartition("/")[2]):
        message, hint = f"its id would end in {name!r}, which is no folder", "give the file a name before its suffix"
        return [Problem(fence.shown(file), 0, 0, "SC041", message, hint)]
    tree, problems = library.read(file, defaults=True)
    if choice is not None and isinstance(tree, Fields):
        tree = with_stack(tree, choice)
        library.add(choice.texts, choice.files)
    if not problems and tree is not None:
        spec = check(ScenarioSpec, tree)
        if not isinstance(spec, list) and isinstance(tree, Fields):
            loaded = _with_assets(spec, tree, library, file)
            return loaded if isinstance(loaded, list) else replace(loaded, choice=choice)
        problems = [*(spec if isinstance(spec, list) else ()), *_problems_of_world(tree, library)]
    return library.with_source(sorted(problems))


def _problems_of_world(tree: Node, library: Library) -> list[Problem]:
    """What is wrong with the world file of a scenario that is wrong itself: better told at once than next time."""
    assets, node = Assets(library), child(tree, "world")
    if isinstance(node, Leaf) and isinstance(node.value, str):
        assets.world(node)
    return assets.problems


def _with_assets(spec: ScenarioSpec, tree: Fields, library: Library, file: Path) -> LoadedScenario | list[Problem]:
    assets = Assets(library)
    world = _world(spec, tree, assets, file)
    robot_map = _map(spec, tree, assets)
    keepout_mask = _mask(spec.stack.keepout_mask, tree, ("stack", "keepout_mask"), assets)
    limits = spec.stack.speed_mask
    speed_mask = _mask(limits.file if limits else None, tree, ("stack", "speed_mask", "file"), assets)
    judged = judged_masks(spec, tree, assets)
    robot = assets.robot(spec.robot.model, value_place(tree, ("robot", "model")))
    if world is None or robot is None or assets.problems:
        return library.with_source(sorted(assets.problems))
    fence, shown, places = library.fence, library.fence.shown(file), places_of(world)
    strangers = library.with_source(list(unknown_places(spec, tree, places)))
    loaded = LoadedScenario(
        id=scenario_id(file, fence.root),
        path=shown,
        file=file,
        root=fence.root,
        world_path=fence.world_path,
        text=library.texts[shown],
        spec=placed(spec, places),
        world=world,
        map=robot_map,
        robot=robot,
        tree=tree,
        sources=dict(library.texts),
        files=dict(library.files),
        notes=_notes(
            world.map,
            robot_map if robot_map != "none" else None,
            keepout_mask,
            speed_mask,
            *(mask.map for mask in judged.values()),
        ),
        keepout_mask=keepout_mask,
        speed_mask=speed_mask,
        judged_masks=judged,
    )
    problems = sorted(inconsistencies(loaded, strangers=strangers))
    if any(problem.severity == "error" for problem in problems):
        return problems
    return replace(loaded, notes=(*loaded.notes, *problems))


def _world(spec: ScenarioSpec, tree: Fields, assets: Assets, file: Path) -> LoadedWorld | None:
    node = at(tree, ("world",))
    if isinstance(spec.world, WorldSpec):
        return assets.own_world(spec.world, node, file)
    return assets.world(node) if isinstance(node, Leaf) else None


def _map(spec: ScenarioSpec, tree: Fields, assets: Assets) -> LoadedMap | Literal["none"] | None:
    node = at(tree, ("map",))
    if spec.map is None or spec.map == "none" or not isinstance(node, Leaf):
        return "none" if spec.map == "none" else None
    return assets.map(node)


def _mask(written: str | None, tree: Fields, keys: tuple[Key, ...], assets: Assets) -> LoadedMap | None:
    """The filter mask that the stack names there."""
    node = at(tree, keys)
    return assets.map(node) if written is not None and isinstance(node, Leaf) else None


def _notes(*maps: LoadedMap | None) -> tuple[Problem, ...]:
    """What was noted about the maps used, each once."""
    return tuple(dict.fromkeys(note for used in maps if used for note in used.notes))


def unusable_name(name: str) -> bool:
    """Whether a scenario of that name could have no folder of its own in the output."""
    return name in ("", ".", "..")


def scenario_id(file: Path, root: Path) -> str:
    """The path of a scenario relative to the root, without its suffix."""
    shown = file.relative_to(root).as_posix() if file.is_relative_to(root) else file.name
    return next((shown.removesuffix(suffix) for suffix in SUFFIXES if shown.endswith(suffix)), shown)
