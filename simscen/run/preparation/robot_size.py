"""How much room a robot takes."""

import math
from dataclasses import dataclass, replace

from simscen.core.environment.world_model import Polygon, World
from simscen.core.geometry.polygons import distance_to_segment
from simscen.core.geometry.shapes import Solid
from simscen.loading.loaded import LoadedScenario
from simscen.model.robot import RobotSpec
from simscen.run.preparation.loaders import load_robot
from simscen.sim.ground import refuse_dragging
from simscen.sim.robot_body import RobotBody
from simscen.worlds.flat import is_flat

CIRCLE_CORNERS = 24
"""Of the polygon that stands for a round footprint."""


@dataclass(frozen=True)
class RobotSize:
    """Its `footprint` in its base frame, the `radius` of a round one, and the `height` of its hull in metres."""

    footprint: Polygon
    radius: float | None
    height: float

    @property
    def inscribed(self) -> float:
        """Metres: no part of the footprint's edge is nearer to the base's origin."""
        return inscribed_radius(self.radius, self.footprint)


def inscribed_radius(radius: float | None, footprint: Polygon) -> float:
    """The largest circle about the base's origin inside a robot's footprint, in metres; a round one is its own."""
    if radius is not None:
        return radius
    ends = (*footprint[1:], footprint[0])
    return min(distance_to_segment(0.0, 0.0, a, b) for a, b in zip(footprint, ends, strict=True))


def robot_size(loaded: LoadedScenario) -> RobotSize:
    """That of a scenario's robot. Raises InvalidInput for a robot that cannot be used.

    One of simple shapes whose file says how much ground it covers need not be built for that.
    """
    spec = loaded.robot.spec
    if spec is not None and spec.body is not None and (spec.radius is not None or spec.footprint is not None):
        refuse_dragging(spec, loaded.robot.path)
        corners = tuple((x, y) for x, y in spec.footprint) if spec.footprint is not None else _round(spec.radius or 0.0)
        return RobotSize(corners, spec.radius, _height_of_shapes(spec))
    body = load_robot(loaded)[1]
    return RobotSize(body.footprint, body.radius, _height_of_hull(body))


def _round(radius: float) -> Polygon:
    turns = [2 * math.pi * k / CIRCLE_CORNERS for k in range(CIRCLE_CORNERS)]
    return tuple((radius * math.cos(turn), radius * math.sin(turn)) for turn in turns)


def _height_of_shapes(spec: RobotSpec) -> float:
    return max(part.z + part.tall for part in spec.body or ())


def _height_of_hull(body: RobotBody) -> float:
    from simscen.sim.outline import extremes

    return max(float(solid.pose.apply(extremes(solid.shape))[:, 2].max()) for solid in body.hull)


# MERGED: What of a world is in the way of one robot, which depends on what it can climb.
def blocking_solids(solids: tuple[Solid, ...], body: RobotBody) -> tuple[Solid, ...]:
    """The same solids where the robot finds no ground but the floor; else without the ramps that it climbs."""
    reach = max((wheel.radius for wheel in body.wheels), default=0.0)
    if is_flat(solids, reach):
        return solids
    from simscen.sim.climb import climb_of
    from simscen.worlds.obstacles import obstacles_of

    return obstacles_of(solids, reach, *climb_of(body))


def blocking_world(loaded: LoadedScenario, world: World) -> World:
    """The world with what of its solids is in the way of the scenario's robot, which a flat one need not be built for.

    Raises InvalidInput for a robot that cannot be used.
    """
    spec = loaded.robot.spec
    radius = None if spec is None else getattr(spec.drive, "wheel_radius", 0.0)
    if radius is not None and is_flat(world.solids, 2 * radius):
        return world
    solids = blocking_solids(world.solids, load_robot(loaded)[1])
    return world if solids is world.solids else replace(world, solids=solids)
