"""What a file of criteria says about the runs of a real robot: its goals, the regions, how large it is."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from simscen.core.case import Case
from simscen.core.errors import InvalidInput
from simscen.core.geometry import Pose2
from simscen.core.maskcells import MaskCells
from simscen.core.problems import Problem
from simscen.core.world import World
from simscen.loading.criteria_file import LoadedCriteria
from simscen.loading.messages import suggestion
from simscen.loading.tree import value_place
from simscen.model.world import WorldSpec
from simscen.run.goals import goals_of
from simscen.run.masks import load_judged_masks
from simscen.run.robotsize import inscribed_radius
from simscen.run.worldsource import robot_of, world_of
from simscen.worlds.own import build_own


def case_of(criteria: LoadedCriteria, world_path: Sequence[Path] = ()) -> Case:
    """The case by which a log of others is judged; without a robot it has no footprint. Raises InvalidInput."""
    loaded_world, loaded_robot = criteria.surroundings()
    root = criteria.library.fence.root
    world = build_own(WorldSpec(simscen=1), "") if loaded_world is None else world_of(loaded_world, root, world_path)
    if unknown := list(_unknown_places(criteria, world)):
        raise InvalidInput(criteria.library.with_source(unknown))
    body = None if loaded_robot is None else robot_of(loaded_robot, (root, *criteria.library.fence.world_path))[1]
    return Case(
        start=Pose2(0.0, 0.0, 0.0),
        goals=goals_of(criteria.spec, world),
        regions=world.regions,
        footprint=() if body is None else body.footprint,
        inscribed_radius=0.0 if body is None else inscribed_radius(body.radius, body.footprint),
        time_limit=criteria.spec.time_limit,
        masks=masks_of(criteria),
    )


def masks_of(criteria: LoadedCriteria) -> dict[str, MaskCells]:
    """The filter masks that the file's criteria judge by. Raises InvalidInput."""

    def sourced(problem: Problem) -> Problem:
        return criteria.library.with_source([problem])[0]

    return load_judged_masks(criteria.masks, criteria.tree, sourced)


def _unknown_places(criteria: LoadedCriteria, world: World) -> Iterator[Problem]:
    for index, goal in enumerate(criteria.spec.goals):
        if isinstance(goal.pose, str) and goal.pose not in world.places:
            place = value_place(criteria.tree, ("goals", index, "pose"))
            hint = suggestion(goal.pose, world.places) if world.places else "name the world with `world:`"
            yield Problem(*place, "SC030", f"no place of the world is called `{goal.pose}`", hint)
