"""What of a world is in the way of one robot, which depends on what it can climb."""

from dataclasses import replace

from simscen.core.environment.world_model import World
from simscen.core.geometry.shapes import Solid
from simscen.loading.loaded import LoadedScenario
from simscen.run.worldsource import load_robot
from simscen.sim.robot_body import RobotBody
from simscen.worlds.flat import is_flat


def in_the_way(solids: tuple[Solid, ...], body: RobotBody) -> tuple[Solid, ...]:
    """The same solids where the robot finds no ground but the floor; else without the ramps that it climbs."""
    reach = max((wheel.radius for wheel in body.wheels), default=0.0)
    if is_flat(solids, reach):
        return solids
    from simscen.sim.climb import climb_of
    from simscen.worlds.obstacles import obstacles_of

    return obstacles_of(solids, reach, *climb_of(body))


def as_met(loaded: LoadedScenario, world: World) -> World:
    """The world with what of its solids is in the way of the scenario's robot, which a flat one need not be built for.

    Raises InvalidInput for a robot that cannot be used.
    """
    spec = loaded.robot.spec
    radius = None if spec is None else getattr(spec.drive, "wheel_radius", 0.0)
    if radius is not None and is_flat(world.solids, 2 * radius):
        return world
    solids = in_the_way(world.solids, load_robot(loaded)[1])
    return world if solids is world.solids else replace(world, solids=solids)
