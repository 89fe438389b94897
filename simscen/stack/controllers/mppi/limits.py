"""What MPPI may drive: nav2_mppi_controller's constraints, within what the base can do."""

from dataclasses import dataclass, replace

import numpy as np

from simscen.core.geometry import Array
from simscen.model.mppi import Mppi as MppiSpec
from simscen.stack.controllers.following import DEFAULT_SPEED
from simscen.stack.protocols import RobotModel


@dataclass(frozen=True)
class Limits:
    """Speeds in m/s and rad/s and accelerations in m/s² and rad/s²; `turning_radius` in m, 0 for none.

    Braking is negative, as in Nav2's files.
    """

    vx_max: float
    vx_min: float
    vy_max: float
    wz_max: float
    ax_max: float
    ax_min: float
    ay_max: float
    ay_min: float
    az_max: float
    turning_radius: float

    def scaled(self, share: float) -> "Limits":
        """Under a speed limit: Nav2 scales all velocities by the same share."""
        if share >= 1.0:
            return self
        return replace(
            self, vx_max=self.vx_max * share, vx_min=self.vx_min * share, vy_max=self.vy_max * share,
            wz_max=self.wz_max * share,
        )  # fmt: skip

    @property
    def faster(self) -> Array:
        """m/s² and rad/s² (3,) of vx, wz and vy towards higher speeds, whichever way."""
        return np.array([self.ax_max, self.az_max, self.ay_max])

    @property
    def slower(self) -> Array:
        """The same of braking, negative."""
        return np.array([self.ax_min, -self.az_max, self.ay_min])

    @property
    def low(self) -> Array:
        """The least velocities (3,) of vx, wz and vy."""
        return np.array([self.vx_min, -self.wz_max, -self.vy_max])

    @property
    def high(self) -> Array:
        """The greatest."""
        return np.array([self.vx_max, self.wz_max, self.vy_max])


def limits_of(spec: MppiSpec, robot: RobotModel, fastest: float) -> Limits:
    """What the specification asks for, or leaves to the robot, and no more than that can do."""
    ahead, back, turn = robot.linear_acceleration, -robot.linear_deceleration, robot.angular_acceleration
    sideways = DEFAULT_SPEED if spec.vy_max is None else spec.vy_max
    radius = robot.turning_radius if spec.min_turning_r is None else spec.min_turning_r
    return Limits(
        vx_max=fastest,
        vx_min=max(spec.vx_min, -robot.max_reverse),
        vy_max=min(sideways, robot.max_lateral),
        wz_max=min(spec.wz_max, robot.max_angular),
        ax_max=min(spec.ax_max or ahead, ahead),
        ax_min=max(spec.ax_min or back, back),
        ay_max=min(spec.ay_max or ahead, ahead),
        ay_min=max(spec.ay_min or back, back),
        az_max=min(spec.az_max or turn, turn),
        turning_radius=max(radius, robot.turning_radius),
    )
