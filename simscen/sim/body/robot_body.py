"""A robot made ready for physics: one rigid hull, wheels where its drive needs them. Needs no engine."""

import math
from dataclasses import dataclass

from simscen.core.environment.world_model import Polygon
from simscen.core.geometry import Pose3
from simscen.core.geometry.shapes import Solid, Sphere
from simscen.model.robot import Drive, Limits, RobotSpec
from simscen.sim.body.inertia import MassProperties
from simscen.sim.body.outline import circle, footprint
from simscen.sim.body.undercarriage import Wheel, add_casters, add_motors, wheel_guards


@dataclass(frozen=True, eq=False)
class RobotBody:
    """Everything needed to build a robot, in its base frame: on the ground under the middle of its axle.

    `hull` and `casters` touch obstacles; `casters` also glide on the ground without friction; wheels only roll on it.
    `chassis` is the mass of all but the wheels; `power` is the share of their force that its motors have. `footprint`
    is anticlockwise; `radius` is set for a round robot.
    """

    name: str
    hull: tuple[Solid, ...]
    casters: tuple[Solid, ...]
    wheels: tuple[Wheel, ...]
    chassis: MassProperties
    footprint: Polygon
    radius: float | None
    drive: Drive
    limits: Limits
    power: float = 1.0

    @property
    def mass(self) -> float:
        """Of the whole robot in kg."""
        return self.chassis.mass + sum(wheel.inertia.mass for wheel in self.wheels)

    @property
    def solid(self) -> tuple[Solid, ...]:
        """What can touch an obstacle, in the order in which the engine gets it."""
        return (*self.casters, *self.hull)

    @property
    def tires(self) -> tuple[Solid, ...]:
        """What wheels roll on the ground with: balls."""
        return tuple(Solid(Sphere(wheel.radius), Pose3(wheel.x, wheel.y, wheel.radius)) for wheel in self.wheels)

    @property
    def circumscribed_radius(self) -> float:
        """The smallest circle around the base's origin that holds the footprint, in meters."""
        return max(math.hypot(x, y) for x, y in self.footprint)


def assemble(
    spec: RobotSpec, parts: tuple[Solid, ...], wheels: tuple[Wheel, ...], chassis: MassProperties
) -> RobotBody:
    """Put a hull on wheels: casters where two wheels would let it fall, and a footprint where none is given."""
    hull = (*parts, *(guard for wheel in wheels for guard in wheel_guards(wheel, parts)))
    outline = footprint(hull)
    casters: tuple[Solid, ...] = ()
    if spec.drive.type == "differential":
        chassis, casters = add_casters(chassis, outline, min(wheel.radius for wheel in wheels))
    given = None if spec.footprint is None else tuple((x, y) for x, y in spec.footprint)
    corners = circle(spec.radius) if spec.radius is not None else given or outline
    wheels = add_motors(wheels, spec.drive, chassis.mass + sum(wheel.inertia.mass for wheel in wheels))
    return RobotBody(spec.name, hull, casters, wheels, chassis, _anticlockwise(corners), spec.radius, spec.drive,
                     spec.limits)  # fmt: skip


def _anticlockwise(polygon: Polygon) -> Polygon:
    ends = (*polygon[1:], polygon[0])
    area = sum(ax * by - bx * ay for (ax, ay), (bx, by) in zip(polygon, ends, strict=True))
    return polygon if area > 0 else polygon[::-1]
