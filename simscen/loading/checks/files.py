"""Recognizes the kind of a file (scenario, world, robot, …), and checks a file of any kind."""

from collections.abc import Sequence
from pathlib import Path

from simscen.core.errors import Problem
from simscen.loading.checks.runner import check_world_file
from simscen.loading.file_kinds import NAV2_FILE_KIND, kind_of_content
from simscen.loading.files.assets import SDF_SUFFIXES, URDF_SUFFIXES, Assets
from simscen.loading.files.discovery import (
    BASE_SUFFIXES,
    ROBOT_SUFFIXES,
    SCENARIO_SUFFIXES,
    STACK_SUFFIXES,
    STUDY_SUFFIXES,
    WORLD_SUFFIXES,
)
from simscen.loading.files.paths import PathSandbox
from simscen.loading.loaded import KEEPOUT_MASK_KEYS, SPEED_MASK_KEYS
from simscen.loading.multirobot import has_valid_robots, split_by_robot
from simscen.loading.scenario import try_variations
from simscen.loading.schema.validate import check_partial
from simscen.loading.stacks.nav2_expansion import with_nav2_parameters
from simscen.loading.stacks.stack_files import read_stack_file
from simscen.loading.variations.variation_problems import VariationProblems, merge_problems
from simscen.loading.yaml.library import APPEND_SUFFIX, DEFAULTS_FILE, Library
from simscen.loading.yaml.tree import MappingNode, ScalarNode, child, existing_keys, items_of, node_at
from simscen.model.scenario import ScenarioSpec

CHECKED_VARIATIONS = range(1, 21)
"""Numbers of the variations of a study that are checked, from 1."""
STACK_KINDS = ("stack", NAV2_FILE_KIND)
"""Kinds of files that contain parameters of a stack."""
_SUFFIXES_BY_KIND = (
    ("scenario", SCENARIO_SUFFIXES),
    ("study", STUDY_SUFFIXES),
    ("base", BASE_SUFFIXES),
    ("world", (*WORLD_SUFFIXES, *SDF_SUFFIXES)),
    ("robot", (*ROBOT_SUFFIXES, *URDF_SUFFIXES)),
    ("stack", STACK_SUFFIXES),
)


def check_file(kind: str, file: Path, root: Path, world_path: Sequence[Path] = ()) -> list[Problem]:
    """Return the errors and warnings of a file and of the files that it names. `kind` is from `file_kind`."""
    if kind in ("scenario", "study"):
        loaded = try_variations(
            file, root, world_path, variation_numbers=CHECKED_VARIATIONS if kind == "study" else None
        )
        if isinstance(loaded, list):
            return loaded
        return merge_problems([VariationProblems(s.variation, s.varied_paths, s.notes) for s in loaded])
    library = Library(PathSandbox.around(root, world_path))
    if isinstance(path := library.sandbox.resolve_argument(file), Problem):
        return [path]
    if kind in STACK_KINDS:
        stack = read_stack_file(path, library)
        return stack if isinstance(stack, list) else stack[1]
    if kind == "base":
        return _base_file_problems(path, library)
    assets = Assets(library)
    world_problems: list[Problem] = []
    if kind == "world":
        world = assets.world_file(path)
        world_problems = check_world_file(world) if world is not None else []
    elif kind == "robot":
        assets.robot_file(path)
    else:
        assets.map_file(path)
    return library.with_source(sorted([*assets.problems, *world_problems]))


def file_kind(file: Path, root: Path) -> str:
    """Return the kind of a file, recognized by its suffix or its top-level keys.

    The kind is "study", "world", "robot", "stack", "base", "map" (a ROS map), NAV2_FILE_KIND, or else "scenario".
    """
    if file.name == DEFAULTS_FILE:
        return "base"
    for kind, suffixes in _SUFFIXES_BY_KIND:
        if file.name.endswith(suffixes):
            return kind
    library = Library(PathSandbox.around(root))
    tree, _ = library.read(file.absolute())
    display_name = library.sandbox.display_name(file.absolute())
    kind = kind_of_content(tree, "".join(library.texts.values()), display_name)
    return "scenario" if kind == "xml" else kind


def _base_file_problems(file: Path, library: Library) -> list[Problem]:
    """Return the problems of a file that scenarios extend, and of the world and robot that it names."""
    tree, problems = library.read(file)
    if problems or tree is None:
        return library.with_source(problems)
    if not isinstance(tree, MappingNode):
        return library.with_source(check_partial(ScenarioSpec, tree))
    names = {key: key.removesuffix(APPEND_SUFFIX) for key in tree.entries}
    entries = {key if names[key] in tree.entries else names[key]: entry for key, entry in tree.entries.items()}
    renamed = MappingNode(tree.position, entries)  # with `pass` for `pass+`, unless the file has both
    expanded = with_nav2_parameters(renamed, library)
    assets = Assets(library)
    for part in split_by_robot(renamed).values() if has_valid_robots(renamed) else [renamed]:
        _load_named_files(part, assets)
    problems = [*check_partial(ScenarioSpec, expanded.tree), *expanded.problems, *expanded.notes, *assets.problems]
    return library.with_source(sorted(set(problems)))


def _load_named_files(tree: MappingNode, assets: Assets) -> None:
    """Load the world, robot, maps, and masks that a scenario tree names. Problems are added to `assets`."""
    masks = [
        ("pass", index, *keys)
        for index in range(len(items_of(child(tree, "pass"))))
        for keys in (("keepout", "mask"), ("speed", "mask", "file"))
    ]
    for keys in (("world",), ("robot", "model"), ("map",), KEEPOUT_MASK_KEYS, SPEED_MASK_KEYS, *masks):
        node = node_at(tree, keys)
        if existing_keys(tree, keys) != keys or not isinstance(node, ScalarNode) or not isinstance(node.value, str):
            continue  # validation reports values of a wrong type
        if keys == ("world",):
            assets.world(node)
        elif keys == ("robot", "model"):
            assets.robot(node.value, node.position)
        elif keys != ("map",) or node.value != "none":
            assets.map(node)
