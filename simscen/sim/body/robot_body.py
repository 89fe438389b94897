"""Rigid-body model of a robot, independent of the physics engine: hull, wheels, and masses."""

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from simscen.core.errors import InvalidInput, Problem
from simscen.core.geometry import Polygon, Pose3, Vector
from simscen.core.geometry.polygons import inscribed_radius, polygon_contains
from simscen.core.geometry.shapes import Solid, Sphere
from simscen.model.robot import Drive, Limits, Omnidirectional, RobotSpec
from simscen.sim.body.inertia import MassProperties, combine
from simscen.sim.body.outline import circle, convex_hull, footprint, hull_points, radius_and_height
from simscen.sim.body.undercarriage import Wheel, add_casters, add_motors, wheel_guards


@dataclass(frozen=True, eq=False)
class RobotBody:
    """Model of a robot in its base frame. The origin is on the ground below the center of the driven axles.

    hull:           solids that collide with obstacles, with the friction coefficient `hull_friction`
    casters:        spheres that collide with obstacles and slide on the ground without friction
    wheels:         wheels, which touch only the ground
    chassis:        mass properties of everything except the wheels
    footprint:      outline on the floor in m, counterclockwise
    radius:         radius in m of the footprint if it is a circle, else None
    motor_ratio:    fraction of the nominal motor force that the motors of a planar base deliver
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
    motor_ratio: float = 1.0

    @property
    def mass(self) -> float:
        """Mass of the whole robot in kg."""
        return self.chassis.mass + sum(wheel.inertia.mass for wheel in self.wheels)

    @property
    def collision_solids(self) -> tuple[Solid, ...]:
        """Solids that collide with obstacles, in the order in which the engine receives them."""
        return (*self.casters, *self.hull)

    @property
    def tires(self) -> tuple[Solid, ...]:
        """One sphere for each wheel, with the radius and center of the wheel."""
        return tuple(Solid(Sphere(wheel.radius), Pose3(wheel.x, wheel.y, wheel.radius)) for wheel in self.wheels)

    @property
    def inscribed_radius(self) -> float:
        """Radius in m of the largest circle around the base frame's origin inside the footprint."""
        return self.radius if self.radius is not None else inscribed_radius(self.footprint)

    @property
    def circumscribed_radius(self) -> float:
        """Radius in m of the smallest circle around the base frame's origin that contains the footprint."""
        return max(math.hypot(x, y) for x, y in self.footprint)


def assemble_body(
    spec: RobotSpec, parts: tuple[Solid, ...], wheels: tuple[Wheel, ...], chassis: MassProperties
) -> RobotBody:
    """Return the body of a robot. `parts` are the solids of the hull.

    Adds boxes around the wheels (see `wheel_guards`), motors, and casters for a differential drive. If the
    specification has neither footprint nor radius, the footprint is the outline of the hull.
    """
    hull = (*parts, *wheel_guards(wheels, parts))
    outline = footprint(hull)
    casters: tuple[Solid, ...] = ()
    if spec.drive.type == "differential":
        chassis, casters = add_casters(chassis, outline, min(wheel.radius for wheel in wheels))
    specified = None if spec.footprint is None else tuple((x, y) for x, y in spec.footprint)
    corners = circle(spec.radius) if spec.radius is not None else specified or outline
    wheels = add_motors(wheels, spec.drive, chassis.mass + sum(wheel.inertia.mass for wheel in wheels))
    return RobotBody(spec.name, hull, casters, wheels, chassis, _counterclockwise(corners), spec.radius, spec.drive,
                     spec.limits, spec.hull_friction)  # fmt: skip


def _counterclockwise(polygon: Polygon) -> Polygon:
    ends = (*polygon[1:], polygon[0])
    area = sum(ax * by - bx * ay for (ax, ay), (bx, by) in zip(polygon, ends, strict=True))
    return polygon if area > 0 else polygon[::-1]


def add_payload(body: RobotBody, mass: float, position: Vector) -> RobotBody:
    """Return the robot with a point mass of `mass` kg at a position in its base frame."""
    load = MassProperties(mass, np.array(position), np.zeros((3, 3)))
    return replace(body, chassis=combine([body.chassis, load]))


def scale_motor_torque(body: RobotBody, factor: float) -> RobotBody:
    """Return the robot with its motor torque multiplied by `factor`."""
    wheels = tuple(replace(wheel, stall_torque=factor * wheel.stall_torque) for wheel in body.wheels)
    return replace(body, wheels=wheels, motor_ratio=factor * body.motor_ratio)


def hull_height(body: RobotBody) -> float:
    """Return the height of the top of the hull above the ground in m."""
    return max(float(solid.pose.apply(hull_points(solid.shape))[:, 2].max()) for solid in body.hull)


def center_of_mass(body: RobotBody) -> Vector:
    """Return the center of mass of the whole robot in its base frame."""
    wheels = [wheel.inertia.mass * np.array((wheel.x, wheel.y, wheel.radius)) for wheel in body.wheels]
    x, y, z = (np.sum([body.chassis.mass * body.chassis.center, *wheels], axis=0) / body.mass).tolist()
    return x, y, z


def is_stable(body: RobotBody) -> bool:
    """Return whether the center of mass is above the support polygon. True for omnidirectional and mecanum drives."""
    points = [(wheel.x, wheel.y) for wheel in body.wheels] + [(c.pose.x, c.pose.y) for c in body.casters]
    x, y, _ = center_of_mass(body)
    return len(points) < 3 or body.drive.type == "mecanum" or polygon_contains(convex_hull(np.array(points)), (x, y))


MIN_GROUND_CLEARANCE_M = 0.003
"""Smallest allowed height in m of a hull above the ground."""


def check_ground_clearance(spec: RobotSpec, file: Path | None) -> None:
    """Raise InvalidInput with the path `file` if a robot on wheels has a part below MIN_GROUND_CLEARANCE_M."""
    on_wheels = not isinstance(spec.drive, Omnidirectional)
    if on_wheels and any(part.z < MIN_GROUND_CLEARANCE_M for part in spec.body or ()):
        message = f"a part of the body of {spec.name!r} reaches the ground: it would drag instead of roll"
        hint = f"give each part a `z` of at least {MIN_GROUND_CLEARANCE_M:g} m"
        raise InvalidInput([Problem(str(file or spec.name), 0, 0, "SC401", message, hint)])


MAX_EXTENT_M = 10.0
"""Largest allowed distance in m of any part of a robot from its base frame."""


def check_robot_size(body: RobotBody, file: Path | None) -> None:
    """Raise InvalidInput with the path `file` if a robot extends farther than MAX_EXTENT_M."""
    across, up = radius_and_height(body.collision_solids)
    wheels = max((math.hypot(wheel.x, wheel.y) + wheel.radius for wheel in body.wheels), default=0.0)
    farthest = max(across, up, wheels, body.circumscribed_radius)
    if farthest > MAX_EXTENT_M:
        message = f"robot {body.name!r} reaches {farthest:.4g} m from its base, more than {MAX_EXTENT_M:g} m"
        hint = "are lengths in millimeters? they are in meters here"
        raise InvalidInput([Problem(str(file or body.name), 0, 0, "SC402", message, hint)])
