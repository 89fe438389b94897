"""Case of a criteria file: the facts that criteria need besides the log of a real robot."""

from simscen.core.environment.world_model import World
from simscen.core.geometry import Pose2
from simscen.core.records.case import Case
from simscen.loading.builders import load_criterion_masks, robot_from_file, world_from_file
from simscen.loading.files.criteria_file import LoadedCriteria
from simscen.loading.goals import expected_failures, scenario_goals
from simscen.model.world import WorldSpec
from simscen.worlds.world_file import world_from_spec


def case_from_criteria(criteria: LoadedCriteria) -> Case:
    """Return the case of a criteria file. Raises InvalidInput.

    The case has no footprint if the file names no robot.
    """
    _, loaded_robot = criteria.load_world_and_robot()
    world = world_of_criteria(criteria)
    folders = (criteria.library.sandbox.root, *criteria.library.sandbox.world_path)
    body = None if loaded_robot is None else robot_from_file(loaded_robot, folders)[1]
    goals = scenario_goals(criteria.spec)
    return Case(
        start=Pose2(0.0, 0.0, 0.0),
        goals=goals,
        expected=expected_failures(criteria.spec, goals),
        regions=world.regions,
        footprint=() if body is None else body.footprint,
        inscribed_radius=0.0 if body is None else body.inscribed_radius,
        time_limit=criteria.spec.time_limit,
        masks=load_criterion_masks(criteria.masks, criteria.tree, criteria.library.texts),
    )


def world_of_criteria(criteria: LoadedCriteria) -> World:
    """Return the world that a criteria file names; an empty world if it names none. Raises InvalidInput."""
    loaded, _ = criteria.load_world_and_robot()
    if loaded is None:
        return world_from_spec(WorldSpec(simscen=1), "")
    return world_from_file(loaded, criteria.library.sandbox.root, criteria.library.sandbox.world_path)
