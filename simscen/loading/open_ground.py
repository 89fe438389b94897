"""Extension of the bounds of a world with open ground to the starts and goals of all robots."""

from collections.abc import Iterator
from dataclasses import replace

from simscen.core.environment.world_model import World
from simscen.core.geometry import Pose2
from simscen.loading.goals import event_goals, expects_failure, scenario_goals
from simscen.loading.loaded import LoadedScenario
from simscen.loading.world_cache import Bounds


def with_stops_in_bounds(world: World, loaded: LoadedScenario) -> World:
    """Return the world with bounds that contain the stops of all robots.

    Stops are start poses, goals without an expected failure, and poses to which events kidnap a robot. A world without
    open ground, or with a map, is returned unchanged.
    """
    if not world.has_open_ground or world.grid is not None or loaded.map is not None:
        return world
    stops = [stop for view in loaded.robot_views.values() for stop in _stops(view)]
    first = stops[0][:2]
    bounds = extend_bounds(world.bounds if any(world.bounds) else (*first, *first), stops)
    return world if bounds == world.bounds else replace(world, bounds=bounds)


def _stops(loaded: LoadedScenario) -> Iterator[Pose2]:
    spec = loaded.spec
    yield spec.only_robot.pose.pose
    for goal in (*scenario_goals(spec), *event_goals(loaded).values()):
        if not expects_failure(spec, goal.name):
            yield goal.pose
    yield from (one.spec.pose.pose for one in loaded.actions if one.kind == "kidnap")


def extend_bounds(bounds: Bounds, poses: list[Pose2]) -> Bounds:
    """Return the smallest bounds that contain `bounds` and the poses."""
    left, bottom, right, top = bounds
    xs, ys = [pose.x for pose in poses], [pose.y for pose in poses]
    return min([left, *xs]), min([bottom, *ys]), max([right, *xs]), max([top, *ys])
