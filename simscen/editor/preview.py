"""Preview for the editor page: shortest paths and clearances of the robots, shown while the user drags an object."""

import math
from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np

from simscen.core.errors import InvalidInput
from simscen.core.geometry import Array, Pose2
from simscen.core.geometry.polylines import polyline_length
from simscen.editor.checking import TextChecks
from simscen.loading.builders import extend_bounds
from simscen.loading.checks.scene import Scene
from simscen.loading.goals import scenario_goals
from simscen.loading.loaded import LoadedScenario
from simscen.loading.robot_size import RobotSize, blocking_world, robot_size
from simscen.worlds.routes.shortest_paths import ShortestPaths

OUTLINE_STEP_M = 0.05
"""Distance between the points of the footprint from which the clearance is computed."""
MAX_LEGS = 40
"""Maximum number of legs (paths from the start to a goal or between goals) of each robot."""
MAX_CLEARANCE_M = 1000.0
"""Maximum clearance that the preview contains."""


def preview_data(checks: TextChecks, text: str) -> dict[str, Any]:
    """Return the preview as JSON data: `robots`, and `reason`.

    `robots` has, by path of the robot in the file, the footprint, the legs, and the clearances at the start and the
    goals. If the text has problems, `robots` is empty, and `reason` is a message with the first problem.
    """
    try:
        loaded = checks.load(text)[0]
        robots = {
            f"robots/{name}" if loaded.robots else "robot": _robot_data(view, checks)
            for name, view in loaded.robot_views.items()
        }
    except InvalidInput as error:
        first = min(error.problems)
        place = f"line {first.line}: " if first.line else ""
        return {"reason": f"No path is shown until this is corrected: {place}{first.message}", "robots": {}}
    return {"reason": "", "robots": robots}


def _robot_data(loaded: LoadedScenario, checks: TextChecks) -> dict[str, Any]:
    world = checks.cache.world(loaded)
    size = robot_size(loaded)
    scene = Scene(loaded, blocking_world(loaded, world), size, checks.cache)
    goals = scenario_goals(loaded.spec)[: len(loaded.spec.goals)]
    stops = [scene.start, *(goal.pose for goal in goals)]
    # The cache of shortest paths compares identities. Without immovable bodies, the tuple must therefore be the same.
    immovable = scene.immovable_bodies
    solids = (*scene.world.solids, *immovable) if immovable else scene.world.solids
    paths = checks.cache.shortest_paths(
        solids, extend_bounds(world.bounds, stops), size.inscribed_radius, scene.z_range
    )
    legs = [_leg(paths, *ends) for ends in list(pairwise(stops))[:MAX_LEGS]]
    return {
        "footprint": [[round(x, 4), round(y, 4)] for x, y in size.footprint],
        "legs": legs,
        "clearances": [_clearance(paths, size, stop) for stop in stops],
    }


def _leg(paths: ShortestPaths, start: Pose2, goal: Pose2) -> dict[str, Any]:
    """Return the points and the length in m of the shortest path; without a path, the ends of the leg and None."""
    path = paths.path(start, goal)
    if path is None:
        return {"points": [[start.x, start.y], [goal.x, goal.y]], "length": None}
    return {"points": np.round(path, 3).tolist(), "length": round(polyline_length(path), 2)}


def _clearance(paths: ShortestPaths, size: RobotSize, pose: Pose2) -> float | None:
    """Return the distance in m from the footprint at a pose to the nearest solid; None above MAX_CLEARANCE_M.

    The distance is negative if footprint and solid overlap.
    """
    if size.radius is not None:
        nearest = float(paths.clearances(np.array([[pose.x, pose.y]]))[0]) - size.radius
    else:
        nearest = float(paths.clearances(pose.apply(np.array(list(_outline_points(size))))).min())
    return None if not math.isfinite(nearest) or nearest > MAX_CLEARANCE_M else round(nearest, 3)


def _outline_points(size: RobotSize) -> Iterator[Array]:
    """Yield the center of the robot, and points (x, y) on the outline of its footprint, in the base frame."""
    yield np.zeros(2)
    ends = (*size.footprint[1:], size.footprint[0])
    for a, b in zip(size.footprint, ends, strict=True):
        count = max(1, math.ceil(math.dist(a, b) / OUTLINE_STEP_M))
        yield from np.linspace(a, b, count, endpoint=False)
