"""What a stack is told of its robot: the datasheet of the body that the simulator drives."""

import math

from simscen.model.robot import Ackermann, Holonomic
from simscen.sim.robot_body import RobotBody
from simscen.stack.protocols import RobotModel


def robot_model(body: RobotBody) -> RobotModel:
    """The datasheet of a body."""
    limits, drive = body.limits, body.drive
    holonomic = isinstance(drive, Holonomic)
    return RobotModel(
        footprint=body.footprint,
        radius=body.radius,
        max_linear=limits.linear,
        max_reverse=limits.reverse or limits.linear,
        max_lateral=(limits.lateral or limits.linear) if holonomic else 0.0,
        max_angular=limits.angular,
        linear_acceleration=limits.linear_acceleration,
        linear_deceleration=limits.linear_deceleration or limits.linear_acceleration,
        angular_acceleration=limits.angular_acceleration,
        turning_radius=drive.wheel_base / math.tan(drive.max_steering) if isinstance(drive, Ackermann) else 0.0,
        holonomic=holonomic,
    )
