"""Size of a robot, and selection of the solids of a world that block it."""

import math
from dataclasses import dataclass, replace

from simscen.core.environment.world_model import World
from simscen.core.geometry import Polygon
from simscen.core.geometry.polygons import inscribed_radius
from simscen.core.geometry.shapes import Solid
from simscen.loading.builders import load_robot
from simscen.loading.loaded import LoadedScenario
from simscen.sim.body.robot_body import RobotBody, check_ground_clearance
from simscen.worlds.geometry.prisms import has_no_drivable_solids

CIRCLE_CORNERS = 24
"""Number of corners of the polygon that approximates a round footprint."""


@dataclass(frozen=True)
class RobotSize:
    """Size of a robot. All lengths are in m."""

    footprint: Polygon
    """Corners of the footprint in the base frame."""
    radius: float | None
    """Radius of a round footprint; None for a polygon."""
    height: float
    """Height of the top of the hull above the floor."""
    underside: float | None = None
    """Height of the underside of an omnidirectional or mecanum base above the floor; None for bases that climb."""

    @property
    def inscribed_radius(self) -> float:
        """Radius of the largest circle inside the footprint, around the origin of the base frame."""
        return self.radius if self.radius is not None else inscribed_radius(self.footprint)


def robot_size(loaded: LoadedScenario) -> RobotSize:
    """Return the size of the robot of a scenario. Raises InvalidInput for an unusable robot."""
    spec = loaded.robot.spec
    if (  # building the body is slow, and not needed if the robot file states its shapes and its footprint or radius
        spec is not None
        and spec.body is not None
        and (spec.radius is not None or spec.footprint is not None)
        and spec.drive.type != "mecanum"
    ):
        check_ground_clearance(spec, loaded.robot.path)
        polygon = spec.footprint
        corners = _circle_corners(spec.radius or 0.0) if polygon is None else tuple((x, y) for x, y in polygon)
        underside = min(part.z for part in spec.body) if spec.drive.type == "omnidirectional" else None
        height = max(part.z + part.total_height for part in spec.body)
        return RobotSize(corners, spec.radius, height, underside)
    from simscen.sim.body.outline import hull_points

    body = load_robot(loaded)[1]
    heights = [solid.pose.apply(hull_points(solid.shape))[:, 2] for solid in body.hull]
    underside = min(float(z.min()) for z in heights) if body.drive.type in ("omnidirectional", "mecanum") else None
    return RobotSize(body.footprint, body.radius, max(float(z.max()) for z in heights), underside)


def _circle_corners(radius: float) -> Polygon:
    angles = [2 * math.pi * k / CIRCLE_CORNERS for k in range(CIRCLE_CORNERS)]
    return tuple((radius * math.cos(angle), radius * math.sin(angle)) for angle in angles)


def blocking_solids(solids: tuple[Solid, ...], body: RobotBody) -> tuple[Solid, ...]:
    """Return the solids that block a robot: all except those that it can drive over or climb, such as ramps."""
    reach = max((wheel.radius for wheel in body.wheels), default=0.0)
    if has_no_drivable_solids(solids, reach):
        return solids
    from simscen.sim.body.climb_limits import compute_climb_limits
    from simscen.worlds.geometry.drive_obstacles import drive_obstacles

    return drive_obstacles(solids, reach, *compute_climb_limits(body))


def blocking_world(loaded: LoadedScenario, world: World) -> World:
    """Return the world with only the fixed solids that block the robot of a scenario. Raises InvalidInput."""
    spec = loaded.robot.spec
    radius = None if spec is None else getattr(spec.drive, "wheel_radius", 0.0)
    # Building the robot is slow, and not needed if no robot of its wheel size could drive over a solid.
    if radius is not None and has_no_drivable_solids(world.solids, 2 * radius):
        return world
    solids = blocking_solids(world.solids, load_robot(loaded)[1])
    return world if solids is world.solids else replace(world, solids=solids)
