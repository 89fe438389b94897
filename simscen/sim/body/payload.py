"""A robot that is not as its datasheet has it: something on its back, motors that have grown weak."""

from dataclasses import replace

import numpy as np

from simscen.core.geometry.polygons import polygon_contains
from simscen.sim.body.inertia import MassProperties, combine
from simscen.sim.body.outline import convex_hull, hull_points
from simscen.sim.body.robot_body import RobotBody

Vector = tuple[float, float, float]


def add_payload(body: RobotBody, mass: float, at: Vector) -> RobotBody:
    """The robot with a load of `mass` kg in one point `at` in its base frame; its motors stay as they are."""
    load = MassProperties(mass, np.array(at), np.zeros((3, 3)))
    return replace(body, chassis=combine([body.chassis, load]))


def scale_motor_torque(body: RobotBody, share: float) -> RobotBody:
    """The robot with a share of the torque of its motors."""
    wheels = tuple(replace(wheel, torque=share * wheel.torque) for wheel in body.wheels)
    return replace(body, wheels=wheels, power=share * body.power)


def hull_height(body: RobotBody) -> float:
    """How high the hull is, in m."""
    return max(float(solid.pose.apply(hull_points(solid.shape))[:, 2].max()) for solid in body.hull)


def center(body: RobotBody) -> Vector:
    """The center of mass of the whole robot in its base frame."""
    wheels = [wheel.inertia.mass * np.array((wheel.x, wheel.y, wheel.radius)) for wheel in body.wheels]
    x, y, z = (np.sum([body.chassis.mass * body.chassis.center, *wheels], axis=0) / body.mass).tolist()
    return x, y, z


def is_stable(body: RobotBody) -> bool:
    """Whether its center of mass is above what its wheels and casters span; a base without wheels never tips."""
    feet = [(wheel.x, wheel.y) for wheel in body.wheels] + [(c.pose.x, c.pose.y) for c in body.casters]
    x, y, _ = center(body)
    return len(feet) < 3 or body.drive.type == "mecanum" or polygon_contains(convex_hull(np.array(feet)), (x, y))
