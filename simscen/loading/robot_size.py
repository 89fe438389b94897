"""Size of a robot, and the parts of a world that block it."""

import math
from dataclasses import dataclass, replace

from simscen.core.environment.world_model import Polygon, World
from simscen.core.geometry.polygons import distance_to_segment
from simscen.core.geometry.shapes import Solid
from simscen.loading.builders import load_robot
from simscen.loading.loaded import LoadedScenario
from simscen.model.robot import RobotSpec
from simscen.sim.body.robot_body import RobotBody, check_ground_clearance
from simscen.worlds.geometry.prisms import has_no_drivable_solids

CIRCLE_CORNERS = 24
"""Corners of the polygon that approximates a round footprint."""


@dataclass(frozen=True)
class RobotSize:
    """Size of a robot: `footprint` (base frame, m), `radius` of a round one (m), and `height` of the hull (m).

    `underside` is the height (m) of the lowest point of the hull of an omnidirectional or mecanum base, which stays at
    z = 0. It is None for other bases, whose wheels climb low obstacles.
    """

    footprint: Polygon
    radius: float | None
    height: float
    underside: float | None = None

    @property
    def inscribed(self) -> float:
        """The inscribed radius in m."""
        return inscribed_radius(self.radius, self.footprint)


def inscribed_radius(radius: float | None, footprint: Polygon) -> float:
    """Return the radius in m of the largest circle around the base's origin inside the footprint."""
    if radius is not None:
        return radius
    ends = (*footprint[1:], footprint[0])
    return min(distance_to_segment(0.0, 0.0, a, b) for a, b in zip(footprint, ends, strict=True))


def robot_size(loaded: LoadedScenario) -> RobotSize:
    """Return the size of a scenario's robot. Raises InvalidInput for an unusable robot.

    A robot of simple shapes with a footprint or radius in its file need not be built for this.
    """
    spec = loaded.robot.spec
    if (
        spec is not None
        and spec.body is not None
        and (spec.radius is not None or spec.footprint is not None)
        and spec.drive.type != "mecanum"
    ):
        check_ground_clearance(spec, loaded.robot.path)
        corners = tuple((x, y) for x, y in spec.footprint) if spec.footprint is not None else _round(spec.radius or 0.0)
        is_planar = spec.drive.type == "omnidirectional"
        underside = min(part.z for part in spec.body) if is_planar else None
        return RobotSize(corners, spec.radius, _height_of_shapes(spec), underside)
    body = load_robot(loaded)[1]
    low, high = _hull_heights(body)
    is_planar = body.drive.type in ("omnidirectional", "mecanum")
    return RobotSize(body.footprint, body.radius, high, low if is_planar else None)


def _round(radius: float) -> Polygon:
    angles = [2 * math.pi * k / CIRCLE_CORNERS for k in range(CIRCLE_CORNERS)]
    return tuple((radius * math.cos(angle), radius * math.sin(angle)) for angle in angles)


def _height_of_shapes(spec: RobotSpec) -> float:
    return max(part.z + part.total_height for part in spec.body or ())


def _hull_heights(body: RobotBody) -> tuple[float, float]:
    """Return the lowest and the highest z of the hull in m."""
    from simscen.sim.body.outline import hull_points

    heights = [solid.pose.apply(hull_points(solid.shape))[:, 2] for solid in body.hull]
    return min(float(z.min()) for z in heights), max(float(z.max()) for z in heights)


def blocking_solids(solids: tuple[Solid, ...], body: RobotBody) -> tuple[Solid, ...]:
    """Return the solids that block a robot: all except the ramps that it can climb."""
    reach = max((wheel.radius for wheel in body.wheels), default=0.0)
    if has_no_drivable_solids(solids, reach):
        return solids
    from simscen.sim.body.robot_body import compute_climb_limits
    from simscen.worlds.geometry.drive_obstacles import drive_obstacles

    return drive_obstacles(solids, reach, *compute_climb_limits(body))


def blocking_world(loaded: LoadedScenario, world: World) -> World:
    """Return the world with only the solids that block the scenario's robot.

    The robot is built only if the world is not flat. Raises InvalidInput for an unusable robot.
    """
    spec = loaded.robot.spec
    radius = None if spec is None else getattr(spec.drive, "wheel_radius", 0.0)
    if radius is not None and has_no_drivable_solids(world.solids, 2 * radius):
        return world
    solids = blocking_solids(world.solids, load_robot(loaded)[1])
    return world if solids is world.solids else replace(world, solids=solids)
