"""Specifications of the components that modify velocity commands: velocity smoother and collision monitor."""

from typing import Annotated

from pydantic import Field

from simscen.spec.base import Spec
from simscen.spec.quantities import (
    Duration,
    NonNegativeLength,
    PositiveAcceleration,
    PositiveAngularAcceleration,
    PositiveAngularSpeed,
    PositiveDuration,
    PositiveSpeed,
)


class VelocitySmoother(Spec):
    """nav2_velocity_smoother: limits the acceleration of the commands to the base."""

    enabled: bool = True
    """Whether to use the velocity smoother."""
    max_accel: PositiveAcceleration | None = None
    """Maximum acceleration; default: the limit of the robot."""
    max_angular_accel: PositiveAngularAcceleration | None = None
    """Maximum angular acceleration; default: the limit of the robot."""
    max_decel: PositiveAcceleration | None = None
    """Maximum deceleration; default: the limit of the robot."""
    max_velocity: PositiveSpeed | None = None
    """Maximum of each linear velocity component; default: unlimited."""
    max_angular_velocity: PositiveAngularSpeed | None = None
    """Maximum turn rate; default: unlimited."""
    counter_turn_slip: bool = False
    """Whether to correct turns that the gyroscope measures when wheels slip on one side. It has an effect only with the
    localizers `ekf` and `slip_ekf`. Nav2 has no such correction."""


class CollisionMonitor(Spec):
    """nav2_collision_monitor: stops or slows the robot before a collision."""

    enabled: bool = True
    """Whether to use the collision monitor."""
    source_timeout: PositiveDuration = 0.3
    """Time without lidar data after which the robot stops (nav2_bringup: 1 s)."""
    time_before_collision: PositiveDuration = 0.5
    """Action APPROACH: minimum time before a collision. The robot slows down to keep this time."""
    simulation_time_step: PositiveDuration | None = None
    """Action APPROACH: maximum time step of the simulated motion; default: an eighth of `time_before_collision`
    (nav2_collision_monitor: 0.1 s)."""
    stop_margin: NonNegativeLength = 0.02
    """Action STOP: minimum distance between the footprint and obstacles in the direction of travel. Nav2 has no such
    margin."""
    min_points: Annotated[int, Field(ge=1, le=1000)] = 1
    """Minimum number of scan points of an obstacle (nav2_collision_monitor: 4; nav2_bringup: 6)."""
    hold_timeout: Duration = 1.0
    """Time for which the monitor may hold the robot before navigation fails. 0: unlimited, as in Nav2."""
