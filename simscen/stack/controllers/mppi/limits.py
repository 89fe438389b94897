"""What MPPI may drive: nav2_mppi_controller's constraints, within what the base can do."""

import numpy as np

from simscen.core.geometry import Array
from simscen.model.mppi import Mppi as MppiSpec
from simscen.stack.controllers.following import DEFAULT_SPEED
from simscen.stack.controllers.limits import Axes, Limits, limits_of
from simscen.stack.protocols import RobotModel


def mppi_limits(spec: MppiSpec, robot: RobotModel, fastest: float) -> Limits:
    """What the specification asks for, or leaves to the robot, and no more than that can do."""
    sideways = DEFAULT_SPEED if spec.vy_max is None else spec.vy_max
    return limits_of(
        robot,
        low=(spec.vx_min, -sideways, -spec.wz_max),
        high=(fastest, sideways, spec.wz_max),
        acceleration=(spec.ax_max, spec.ay_max, spec.az_max),
        deceleration=(spec.ax_min, spec.ay_min, None if spec.az_max is None else -spec.az_max),
        turning_radius=spec.min_turning_r,
    )


def in_order(axes: Axes) -> Array:
    """The three in the order of a control sequence: vx, wz, vy."""
    vx, vy, wz = axes
    return np.array((vx, wz, vy))
