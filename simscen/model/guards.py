"""What stands between the controller and the base, and what it knows of things that move."""

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
    """nav2_velocity_smoother: limits accelerations of what is sent to the base."""

    enabled: bool = True
    """Whether it is there at all."""
    max_accel: PositiveAcceleration | None = None
    """Default: the robot's own limit."""
    max_angular_accel: PositiveAngularAcceleration | None = None
    """Default: the robot's own limit."""
    max_decel: PositiveAcceleration | None = None
    """Default: the robot's own limit."""
    max_velocity: PositiveSpeed | None = None
    """Of each component of its velocity; default: what the controller commands."""
    max_angular_velocity: PositiveAngularSpeed | None = None
    """Of its turn rate; default: what the controller commands."""
    counter_turn_slip: bool = False
    """Whether the turn is taken off the command that wheels of which one side slips more add to it, as the gyroscope
    shows; with the localizers `ekf` and `slip_ekf` only. Nav2 does not."""


class CollisionMonitor(Spec):
    """nav2_collision_monitor: the last word before the base."""

    enabled: bool = True
    """Whether it is there at all."""
    source_timeout: PositiveDuration = 0.3
    """A lidar that is silent this long stops the robot (Nav2's default is 1 s)."""
    time_before_collision: PositiveDuration = 0.5
    """APPROACH: slow down so that a collision is at least this far off."""
    stop_margin: NonNegativeLength = 0.02
    """STOP: nothing may be nearer to the footprint than this, in the direction of travel. Nav2 has no such margin."""
    min_points: Annotated[int, Field(ge=1, le=1000)] = 1
    """How many points of a scan there must be in the way. Nav2's default is 4: a chair's leg may be fewer."""
    hold_timeout: Duration = 1.0
    """How long it may hold the robot until that counts as a failure, for the controller may not see what it sees; 0:
    never, as in Nav2, where the progress checker says so in the end."""


class Prediction(Ranged):
    """Motion prediction: what moves is tracked from the lidars' scans and met where it will be."""

    enabled: bool = False
    """Whether it is there at all."""
    max_range: PositiveLength = 12.0
    """Nothing further off is tracked."""
    max_radius: PositiveLength = 1.0
    """Larger things are taken for walls."""
    min_speed: PositiveSpeed = 0.25
    """What is slower stands."""
    acceleration: PositiveAcceleration = 1.5
    """Standard deviation of how fast a tracked thing changes its velocity."""
    margin: NonNegativeLength = 0.15
    """Hits so near to the cylinder of a moving thing are its own, and not marked in costmaps."""
