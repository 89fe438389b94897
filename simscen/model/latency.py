"""What computing and sensing take."""

from typing import Annotated

from pydantic import Field

from simscen.spec.base import Spec
from simscen.spec.places import Name
from simscen.spec.quantities import Duration


class Latency(Spec):
    """Computing time of the parts of a stack; each is a whole number of physics ticks, the nearest one.

    A part works on what there is when it begins, and what it makes of that is there so much later. Parts run beside
    each other, as Nav2's servers do; one that is still busy is not asked again.
    """

    localizer: Duration = 0.0
    """From a scan to the correction that it leads to; odometry carries the pose on meanwhile."""
    costmap: Duration = 0.0
    """From the readings to the costmaps that show them."""
    planner: Duration = 0.0
    """From the question to the plan; the controller goes on with the one it has."""
    controller: Duration = 0.0
    """From pose and costmap to the command."""
    collision_monitor: Duration = 0.0
    """From the command to the one that is sent."""


class RobotLatency(Latency):
    """What computing takes on the robot's usual computer, and how late its sensors' readings usually come.

    It counts where a scenario says `stack: {latency: robot}`.
    """

    sensors: Annotated[dict[Name, Duration], Field(max_length=100)] = {}
    """By name; in place of what the sensor itself says."""
