"""Specifications of the velocity smoother, the collision monitor, and motion prediction."""

from typing import Annotated

from pydantic import Field

from simscen.spec.base import Ranged, Spec
from simscen.spec.quantities import (
    Duration,
    NonNegativeLength,
    PositiveAcceleration,
    PositiveAngularAcceleration,
    PositiveAngularSpeed,
    PositiveDuration,
    PositiveLength,
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
    """Action APPROACH: maximum time step of the simulated motion; default: an eighth of `time_before_collision` (Nav2:
    0.1 s)."""
    stop_margin: NonNegativeLength = 0.02
    """Action STOP: minimum distance between the footprint and obstacles in the direction of travel. Nav2 has no such
    margin."""
    min_points: Annotated[int, Field(ge=1, le=1000)] = 1
    """Minimum number of scan points of an obstacle (Nav2: 4)."""
    hold_timeout: Duration = 1.0
    """Time for which the monitor may hold the robot before navigation fails. 0: unlimited, as in Nav2."""


class Prediction(Ranged):
    """Motion prediction: tracks moving objects in the lidar scans, so that the robot avoids their future positions."""

    enabled: bool = False
    """Whether to predict motion."""
    max_range: PositiveLength = 12.0
    """Maximum distance of tracked objects."""
    max_radius: PositiveLength = 1.0
    """Maximum radius of tracked objects; larger ones are static."""
    min_speed: PositiveSpeed = 0.25
    """Minimum speed of tracked objects; slower ones are static."""
    acceleration: PositiveAcceleration = 1.5
    """Standard deviation of the acceleration of a tracked object."""
    margin: NonNegativeLength = 0.15
    """Distance from a tracked object within which scan points belong to it and are not marked in costmaps."""
