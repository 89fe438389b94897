"""Steepest slope and highest step that a robot can climb when it drives slowly.

Sources: Bekker, Introduction to Terrain-Vehicle Systems, 1969; Wong, Theory of Ground Vehicles, chapters 2 and 4.
"""

import math
from typing import NamedTuple

import numpy as np

from simscen.core.environment.world_model import GRAVITY_M_S2
from simscen.core.geometry.shapes import Sphere
from simscen.sim.body.outline import hull_points
from simscen.sim.body.robot_body import RobotBody
from simscen.sim.body.undercarriage import caster_gap, casters_for_uneven_ground

WHEEL_FRICTION = 1.0
"""Friction coefficient of the wheels on the ground, as for rubber on dry concrete."""
MAX_SLOPE_DEG, SLOPE_STEP_DEG = 50.0, 0.1
"""Upper bound of the slopes that `approach_angle` examines, and the difference between two examined slopes."""


class ClimbLimits(NamedTuple):
    """Steepest slope in rad and highest step in m that a robot can climb.

    Both are 0 for omnidirectional and mecanum drives.
    """

    slope: float
    step: float


def compute_climb_limits(body: RobotBody) -> ClimbLimits:
    """Return the climbing limits that follow from the hull, the motors, and the friction of the wheels."""
    wheels = [wheel for wheel in body.wheels if wheel.is_driven and wheel.stall_torque > 0]
    if not wheels:
        return ClimbLimits(0.0, 0.0)
    pull = sum(wheel.stall_torque / wheel.radius for wheel in wheels) / (body.mass * GRAVITY_M_S2)
    slope = min(approach_angle(body), grip_angle(body, WHEEL_FRICTION), math.asin(min(1.0, pull)))
    return ClimbLimits(slope, min(wheel.radius for wheel in wheels) * (1 - 1 / math.hypot(1.0, WHEEL_FRICTION)))


def grip_angle(body: RobotBody, friction: float) -> float:
    """Return the slope θ in rad above which the wheels spin: tan θ = μ · (weight on driven wheels / total weight).

    The ratio includes the weight that shifts to a caster behind the axle on a slope. Returns 0 for a robot whose center
    of mass is beyond a caster, because such a robot tips over.
    """
    x, z = (float(body.chassis.center[axis]) for axis in (0, 2))
    ground_casters = [caster.pose.x for caster in body.casters if not caster_gap(caster)]
    if not ground_casters:
        return math.atan(friction * _driven_weight_ratio(body))
    chassis_ratio = body.chassis.mass / body.mass
    span = abs(ground_casters[0])
    level = max(0.0, 1.0 - chassis_ratio * abs(x) / span)
    # tan θ = μ (level - chassis_ratio z tan θ / span), if the caster is behind the axle.
    return math.atan(friction * level / (1.0 + friction * chassis_ratio * z / span))


def _driven_weight_ratio(body: RobotBody) -> float:
    """Return the weight on the driven wheels divided by the total weight, on level ground and without casters."""
    driven = [wheel.x for wheel in body.wheels if wheel.is_driven]
    idle = [wheel.x for wheel in body.wheels if not wheel.is_driven]
    if not idle:
        return 1.0
    driven_x, idle_x = sum(driven) / len(driven), sum(idle) / len(idle)
    center = float(body.chassis.center[0]) * body.chassis.mass + sum(w.x * w.inertia.mass for w in body.wheels)
    return min(1.0, max(0.0, (idle_x - center / body.mass) / (idle_x - driven_x)))


def approach_angle(body: RobotBody) -> float:
    """Return the slope in rad of the flattest ramp that touches the hull when the front wheels reach the ramp.

    Raised casters count as hull. Returns the steepest examined slope if no ramp touches the hull.
    """
    foremost = max(body.wheels, key=lambda wheel: wheel.x)
    raised = [c for c in casters_for_uneven_ground(body.casters) if caster_gap(c) > 0 and c.pose.x > foremost.x]
    x, _, z = np.concatenate([solid.pose.apply(hull_points(solid.shape)) for solid in body.hull]).T
    ahead = x > foremost.x
    balls = [(c.pose.x, c.pose.z, c.shape.radius) for c in raised if isinstance(c.shape, Sphere)]
    ball_x, ball_z, ball_radius = np.array(balls).reshape(-1, 3).T
    x, z = np.r_[x[ahead], ball_x] - foremost.x, np.r_[z[ahead], ball_z] - foremost.radius
    gap = np.r_[np.zeros(ahead.sum()), ball_radius] - foremost.radius
    slopes = np.radians(np.arange(0.0, MAX_SLOPE_DEG, SLOPE_STEP_DEG))
    touching = (
        slope
        for slope, sine, cosine in zip(slopes.tolist(), np.sin(slopes), np.cos(slopes), strict=True)
        if (-x * sine + z * cosine < gap).any()
    )
    return next(touching, float(slopes[-1]))
