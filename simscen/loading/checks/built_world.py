"""Checks of the places, regions, and motions in a world file against the geometry of the built world."""

from collections.abc import Iterator

from simscen.core.environment.world_model import World
from simscen.core.errors import Problem
from simscen.loading.checks.placement import motion_stops
from simscen.loading.checks.registry import BUILT_WORLD, CheckProblem
from simscen.loading.checks.scene import TOUCH_M
from simscen.loading.loaded import LoadedWorld
from simscen.loading.schema.messages import quoted
from simscen.model.world import WorldSpec
from simscen.worlds.geometry.overlaps import first_solid_in_disc

BLOCKING_HEIGHTS_M = 0.02, 0.4
"""Lowest and highest z in m between which an obstacle blocks most robots."""
RAMP_ROBOT_WHEEL_RADIUS_M, RAMP_ROBOT_MAX_SLOPE_RAD, RAMP_ROBOT_MAX_STEP_M = 0.1, 0.35, 0.03
"""Wheel radius, maximum slope, and maximum step height of an assumed robot that can climb typical ramps."""


def check_built_world(world: World, source: LoadedWorld) -> list[Problem]:
    """Return warnings about the world file `source`, without source lines; [] for a ROS map or SDF file."""
    return [] if source.tree is None else BUILT_WORLD.problems(source.tree, world, source.spec)


@BUILT_WORLD.check("SC314", severity="warning")
def places_in_obstacles(world: World, spec: WorldSpec) -> Iterator[CheckProblem]:
    """Find places inside obstacles."""
    solids = world.solids
    if spec.ramps:
        from simscen.worlds.geometry.drive_obstacles import drive_obstacles  # imports NumPy

        limits = RAMP_ROBOT_WHEEL_RADIUS_M, RAMP_ROBOT_MAX_SLOPE_RAD, RAMP_ROBOT_MAX_STEP_M
        solids = drive_obstacles(solids, *limits)
    for name, place in spec.places.items():
        solid = first_solid_in_disc(solids, (place.x, place.y), TOUCH_M, BLOCKING_HEIGHTS_M)
        if solid is not None:
            message = f'place {quoted(name)} is inside obstacle "{solid}"'
            yield CheckProblem(("places", name), message, at_key=True)


@BUILT_WORLD.check("SC304", severity="warning")
def motions_into_obstacles(world: World, spec: WorldSpec) -> Iterator[CheckProblem]:
    """Find motions of objects with keyframes or waypoints inside obstacles."""
    for index, movable in enumerate(spec.objects):
        for keys, description, (x, y) in motion_stops(movable.move) if movable.move is not None else ():
            if solid := first_solid_in_disc(world.solids, (x, y), TOUCH_M, BLOCKING_HEIGHTS_M):
                message = f'{description} of {quoted(movable.name)} ({x:g}, {y:g}) is inside obstacle "{solid}"'
                yield CheckProblem(("objects", index, "move", *keys), message)


@BUILT_WORLD.check("SC315", severity="warning")
def regions_outside_the_world(world: World, spec: WorldSpec) -> Iterator[CheckProblem]:
    """Find regions outside the bounds of the world."""
    left, bottom, right, top = world.bounds
    for name, corners in spec.regions.items():
        xs, ys = [x for x, _ in corners], [y for _, y in corners]
        if max(xs) < left or min(xs) > right or max(ys) < bottom or min(ys) > top:
            message = f"region {quoted(name)} is outside the world ({left:g} … {right:g}, {bottom:g} … {top:g})"
            yield CheckProblem(("regions", name), message, at_key=True)
