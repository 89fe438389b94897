"""Check a file of any kind that simscen reads."""

from collections.abc import Sequence
from pathlib import Path

from simscen.core.problems import Problem
from simscen.loading.assets import GAZEBO, URDF, Assets, is_ros_map
from simscen.loading.discovery import BASE, ROBOT, SCENARIO, STACK, WORLD
from simscen.loading.document import DEFAULTS, Library
from simscen.loading.paths import Fence
from simscen.loading.scenario import try_variations
from simscen.loading.sense.worldsense import senseless
from simscen.loading.strangers import PARAMETER_FILE, STACK_FILE, stranger
from simscen.loading.tree import Fields
from simscen.loading.variations.telling import Found, told

STACKS = ("stack", PARAMETER_FILE)
"""Kinds that hold the parameters of a stack."""
_ONLY_ROBOTS = frozenset({"drive", "sensors", "limits", "body", "urdf"})
_ONLY_WORLDS = frozenset({"walls", "obstacles", "objects", "doors", "places", "regions", "map_height", "sdf"})
_ONLY_SCENARIOS = frozenset({"world", "robot", "goals", "pass", "events", "faults", "stack"})
_SUFFIXES = (
    ("scenario", SCENARIO),
    ("base", BASE),
    ("world", (*WORLD, *GAZEBO)),
    ("robot", (*ROBOT, *URDF)),
    ("stack", STACK),
)


def problems_of(kind: str, file: Path, root: Path, world_path: Sequence[Path] = ()) -> list[Problem]:
    """All that is wrong with a file of a kind that kind_of knows, and with the files it names.

    Some are warnings.
    """
    if kind == "scenario":
        loaded = try_variations(file, root, world_path)
        if isinstance(loaded, list):
            return loaded
        return told([Found(one.variation, one.set_by, one.notes) for one in loaded])
    library = Library(Fence.around(root, world_path))
    if isinstance(path := library.fence.entered(file), Problem):
        return [path]
    if kind in STACKS:
        from simscen.loading.stackfile import stack_file  # a model of its own, which few commands need

        return found if isinstance(found := stack_file(path, library), list) else found[1]
    if kind == "base":
        from simscen.loading.basefile import problems_of_base

        return problems_of_base(path, library)
    assets = Assets(library)
    senses: list[Problem] = []
    if kind == "world":
        world = assets.world_file(path)
        senses = senseless(world) if world is not None else []
    elif kind == "robot":
        assets.robot_file(path)
    else:
        assets.map_file(path)
    return library.with_source(sorted([*assets.problems, *senses]))


def kind_of(file: Path, root: Path) -> str:
    """By its name where that tells, else by what only one kind has.

    "scenario", "world", "robot", "stack", "base", "map" or PARAMETER_FILE.
    """
    if file.name == DEFAULTS:
        return "base"
    for kind, suffixes in _SUFFIXES:
        if file.name.endswith(suffixes):
            return kind
    library = Library(Fence.around(root))
    tree, _ = library.read(file.absolute())
    if is_ros_map(tree):
        return "map"
    if strange := stranger(tree, "".join(library.texts.values()), library.fence.shown(file.absolute())):
        return "stack" if strange == STACK_FILE else strange
    keys = set(tree.entries) if isinstance(tree, Fields) else set()
    if keys & _ONLY_SCENARIOS:
        return "scenario"
    return "robot" if keys & _ONLY_ROBOTS else "world" if keys & _ONLY_WORLDS else "scenario"
