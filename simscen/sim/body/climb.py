"""What a robot can drive up, in closed form: the steepest ramp and the highest step.

Quasi-statically, without a run-up, on a surface whose friction against its wheels is `friction`. Sources: Bekker,
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

SLOPES = np.radians(np.arange(0.0, 50.0, 0.1))


class ClimbLimits(NamedTuple):
    """The slope in rad and the step in m that a robot gets up at most; both 0 for one that never leaves z = 0."""

    slope: float
    step: float


def compute_climb_limits(body: RobotBody, friction: float = 1.0) -> ClimbLimits:
    """Return what a robot can climb, limited by its hull, by grip, and by its motors."""
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
    standing = [caster.pose.x for caster in body.casters if not caster_gap(caster)]
    if not standing:
        return math.atan(friction * _driven_share(body))
    share = body.chassis.mass / body.mass
    span = abs(standing[0])
    level = 1.0 - share * abs(x) / span
    # tan θ = μ (level - share z tan θ / span): the caster is behind on the way up.
    return math.atan(friction * level / (1.0 + friction * share * z / span))


def _driven_share(body: RobotBody) -> float:
    """Of the weight on level ground, where two axles carry it."""
    driven = [wheel.x for wheel in body.wheels if wheel.driven]
    idle = [wheel.x for wheel in body.wheels if not wheel.driven]
    if not idle:
        return 1.0
    at, other = sum(driven) / len(driven), sum(idle) / len(idle)
    center = float(body.chassis.center[0]) * body.chassis.mass + sum(w.x * w.inertia.mass for w in body.wheels)
    return min(1.0, max(0.0, (other - center / body.mass) / (other - at)))


def approach_angle(body: RobotBody) -> float:
    """Return the slope in rad of the ramp that the hull touches when the front wheels reach its lower edge."""
    foremost = max(body.wheels, key=lambda wheel: wheel.x)
    hanging = [c for c in compliant_casters(body.casters) if caster_gap(c) > 0 and c.pose.x > foremost.x]
    points = np.concatenate([solid.pose.apply(hull_points(solid.shape)) for solid in body.hull])
    corners = [(x - foremost.x, z, 0.0) for x, _, z in points.tolist() if x > foremost.x]
    corners += [(c.pose.x - foremost.x, c.pose.z, c.shape.radius) for c in hanging if isinstance(c.shape, Sphere)]
    radius = foremost.radius
    free = [
        -ahead * np.sin(SLOPES) + (up - radius) * np.cos(SLOPES) >= around - radius for ahead, up, around in corners
    ]
    scrapes = ~np.logical_and.reduce(free) if free else np.zeros(len(SLOPES), np.bool_)
    return float(SLOPES[np.argmax(scrapes)]) if scrapes.any() else float(SLOPES[-1])
