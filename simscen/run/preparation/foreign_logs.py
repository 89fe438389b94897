"""Build the case by which logs of real robots are judged, from a criteria file."""

from collections.abc import Sequence
from pathlib import Path

from simscen.core.environment.costmap_filters import MaskBlocks
from simscen.core.errors import Problem
from simscen.core.geometry import Pose2
from simscen.core.records.case import Case
from simscen.loading.files.criteriafile import LoadedCriteria
from simscen.model.world import WorldSpec
from simscen.run.preparation.filter_masks import load_criterion_masks
from simscen.run.preparation.goals import expected_failures, scenario_goals
from simscen.run.preparation.loaders import robot_from_file, world_from_file
from simscen.run.preparation.robot_size import inscribed_radius
from simscen.worlds.world_file import build_own


def case_from_criteria(criteria: LoadedCriteria, world_path: Sequence[Path] = ()) -> Case:
    """Return the case of a criteria file; without a robot it has no footprint. Raises InvalidInput."""
    loaded_world, loaded_robot = criteria.surroundings()
    root = criteria.library.fence.root
    world = (
        build_own(WorldSpec(simscen=1), "") if loaded_world is None else world_from_file(loaded_world, root, world_path)
    )
    body = (
        None if loaded_robot is None else robot_from_file(loaded_robot, (root, *criteria.library.fence.world_path))[1]
    )
    goals = scenario_goals(criteria.spec)
    return Case(
        start=Pose2(0.0, 0.0, 0.0),
        goals=goals,
        expected=expected_failures(criteria.spec, goals),
        regions=world.regions,
        footprint=() if body is None else body.footprint,
        inscribed_radius=0.0 if body is None else inscribed_radius(body.radius, body.footprint),
        time_limit=criteria.spec.time_limit,
        masks=masks_from_criteria(criteria),
    )


def masks_from_criteria(criteria: LoadedCriteria) -> dict[str, MaskBlocks]:
    """Load the filter masks of the file's criteria. Raises InvalidInput."""

    def sourced(problem: Problem) -> Problem:
        return criteria.library.with_source([problem])[0]

    return load_criterion_masks(criteria.masks, criteria.tree, sourced)
