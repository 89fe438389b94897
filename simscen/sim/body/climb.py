"""Closed-form limits of what a robot can climb: the steepest ramp and the highest step.

The analysis is quasi-static, without a run-up; `friction` is that between wheels and surface. Sources: Bekker,
Introduction to Terrain-Vehicle Systems, 1969; Wong, Theory of Ground Vehicles, chapters 2 and 4.
"""

import math
from typing import NamedTuple

import numpy as np

from simscen.core.geometry.shapes import Sphere
from simscen.sim.body.inertia import GRAVITY
from simscen.sim.body.outline import hull_points
from simscen.sim.body.robot_body import RobotBody
from simscen.sim.body.undercarriage import caster_gap, compliant_casters

SLOPES_RAD = np.radians(np.arange(0.0, 50.0, 0.1))


class ClimbLimits(NamedTuple):
    """Steepest slope in rad and highest step in m that a robot can climb; both 0 for a robot that stays at z = 0."""

    slope: float
    step: float


def compute_climb_limits(body: RobotBody, friction: float = 1.0) -> ClimbLimits:
    """Return what a robot can climb, limited by its hull, its wheel friction, and its motors."""
    wheels = [wheel for wheel in body.wheels if wheel.driven and wheel.torque > 0]
    if not wheels:
        return ClimbLimits(0.0, 0.0)
    pull = sum(wheel.torque / wheel.radius for wheel in wheels) / (body.mass * GRAVITY)
    slope = min(approach_angle(body), grip_angle(body, friction), math.asin(min(1.0, pull)))
    return ClimbLimits(slope, min(wheel.radius for wheel in wheels) * (1 - 1 / math.hypot(1.0, friction)))


def grip_angle(body: RobotBody, friction: float) -> float:
    """Return the slope in rad on which the wheels spin: tan θ = μ · share of the weight on driven wheels.

    The share decreases with the slope, because the weight shifts back by h tan θ onto a caster behind the axle.
    """
    x, z = (float(body.chassis.center[axis]) for axis in (0, 2))
    ground_casters = [caster.pose.x for caster in body.casters if not caster_gap(caster)]
    if not ground_casters:
        return math.atan(friction * _driven_share(body))
    share = body.chassis.mass / body.mass
    span = abs(ground_casters[0])
    level = 1.0 - share * abs(x) / span
    # tan θ = μ (level - share z tan θ / span): the caster is behind on the way up.
    return math.atan(friction * level / (1.0 + friction * share * z / span))


def _driven_share(body: RobotBody) -> float:
    """Return the share of the weight on the driven wheels of a robot with two axles, on level ground."""
    driven = [wheel.x for wheel in body.wheels if wheel.driven]
    idle = [wheel.x for wheel in body.wheels if not wheel.driven]
    if not idle:
        return 1.0
    driven_x, idle_x = sum(driven) / len(driven), sum(idle) / len(idle)
    center = float(body.chassis.center[0]) * body.chassis.mass + sum(w.x * w.inertia.mass for w in body.wheels)
    return min(1.0, max(0.0, (idle_x - center / body.mass) / (idle_x - driven_x)))


def approach_angle(body: RobotBody) -> float:
    """Return the slope in rad of the ramp that the hull touches when the front wheels reach its lower edge."""
    foremost = max(body.wheels, key=lambda wheel: wheel.x)
    raised = [c for c in compliant_casters(body.casters) if caster_gap(c) > 0 and c.pose.x > foremost.x]
    points = np.concatenate([solid.pose.apply(hull_points(solid.shape)) for solid in body.hull])
    corners = [(x - foremost.x, z, 0.0) for x, _, z in points.tolist() if x > foremost.x]
    corners += [(c.pose.x - foremost.x, c.pose.z, c.shape.radius) for c in raised if isinstance(c.shape, Sphere)]
    radius = foremost.radius
    is_clear = [-x * np.sin(SLOPES_RAD) + (z - radius) * np.cos(SLOPES_RAD) >= size - radius for x, z, size in corners]
    touches = ~np.logical_and.reduce(is_clear) if is_clear else np.zeros(len(SLOPES_RAD), np.bool_)
    return float(SLOPES_RAD[np.argmax(touches)]) if touches.any() else float(SLOPES_RAD[-1])
