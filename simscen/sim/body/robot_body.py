"""Rigid-body model of a robot, independent of the physics engine: hull, wheels, masses, and limits."""

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from simscen.core.environment.world_model import Polygon
from simscen.core.errors import InvalidInput, Problem
from simscen.core.geometry import Pose3
from simscen.core.geometry.polygons import polygon_contains
from simscen.core.geometry.shapes import Solid, Sphere
from simscen.model.robot import Drive, Limits, Omnidirectional, RobotSpec
from simscen.sim.body.inertia import MassProperties, combine
from simscen.sim.body.outline import circle, convex_hull, footprint, hull_points, radius_and_height
from simscen.sim.body.undercarriage import Wheel, add_casters, add_motors, wheel_guards


@dataclass(frozen=True, eq=False)
class RobotBody:
    """Everything needed to build a robot, in its base frame: on the ground under the middle of its axle.

    `hull` and `casters` touch obstacles, the hull with the coefficient `hull_friction`; `casters` also glide on the
    ground without friction; wheels only roll on it.
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
    hull_friction: float
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
                     spec.limits, spec.hull_friction)  # fmt: skip


def _anticlockwise(polygon: Polygon) -> Polygon:
    ends = (*polygon[1:], polygon[0])
    area = sum(ax * by - bx * ay for (ax, ay), (bx, by) in zip(polygon, ends, strict=True))
    return polygon if area > 0 else polygon[::-1]


Vector = tuple[float, float, float]


def add_payload(body: RobotBody, mass: float, at: Vector) -> RobotBody:
    """Return the robot with a load of `mass` kg at a point in its base frame; the motors stay the same."""
    load = MassProperties(mass, np.array(at), np.zeros((3, 3)))
    return replace(body, chassis=combine([body.chassis, load]))


def scale_motor_torque(body: RobotBody, share: float) -> RobotBody:
    """Return the robot with a fraction of its motor torque."""
    wheels = tuple(replace(wheel, torque=share * wheel.torque) for wheel in body.wheels)
    return replace(body, wheels=wheels, power=share * body.power)


def hull_height(body: RobotBody) -> float:
    """How high the hull is, in m."""
    return max(float(solid.pose.apply(hull_points(solid.shape))[:, 2].max()) for solid in body.hull)


def center_of_mass(body: RobotBody) -> Vector:
    """Return the center of mass of the whole robot in its base frame."""
    wheels = [wheel.inertia.mass * np.array((wheel.x, wheel.y, wheel.radius)) for wheel in body.wheels]
    x, y, z = (np.sum([body.chassis.mass * body.chassis.center, *wheels], axis=0) / body.mass).tolist()
    return x, y, z


def is_stable(body: RobotBody) -> bool:
    """Whether its center of mass is above what its wheels and casters span; a base without wheels never tips."""
    feet = [(wheel.x, wheel.y) for wheel in body.wheels] + [(c.pose.x, c.pose.y) for c in body.casters]
    x, y, _ = center_of_mass(body)
    return len(feet) < 3 or body.drive.type == "mecanum" or polygon_contains(convex_hull(np.array(feet)), (x, y))


MIN_GROUND_CLEARANCE_M = 0.005
"""m that a hull must be above the ground."""


def check_ground_clearance(spec: RobotSpec, file: Path | None) -> None:
    """Raise InvalidInput if a part of the `body` of a wheeled robot touches the ground."""
    on_wheels = not isinstance(spec.drive, Omnidirectional)
    if on_wheels and any(part.z < MIN_GROUND_CLEARANCE_M for part in spec.body or ()):
        message = f"a part of the body of {spec.name!r} reaches the ground: it would drag instead of roll"
        hint = f"give each part a `z` of at least {MIN_GROUND_CLEARANCE_M:g} m"
        raise InvalidInput([Problem(str(file or spec.name), 0, 0, "SC401", message, hint)])


# A larger robot would make maps and footprints of the stack exhaust memory and time.
MAX_EXTENT_M = 10.0
"""m from the base, across and in height; the largest vehicles in ports are 15 m long."""


def check_robot_size(body: RobotBody, file: Path | None) -> None:
    """Raise InvalidInput for a robot that extends farther than MAX_EXTENT_M from its base frame."""
    across, up = radius_and_height(body.solid)
    wheels = max((math.hypot(wheel.x, wheel.y) + wheel.radius for wheel in body.wheels), default=0.0)
    farthest = max(across, up, wheels, body.circumscribed_radius)
    if farthest > MAX_EXTENT_M:
        message = f"robot {body.name!r} reaches {farthest:.4g} m from its base, more than {MAX_EXTENT_M:g} m"
        hint = "are lengths in millimeters? they are in meters here"
        raise InvalidInput([Problem(str(file or body.name), 0, 0, "SC402", message, hint)])
