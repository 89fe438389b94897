"""Specifications of computing times and sensor delays."""

from typing import Annotated

from pydantic import Field

from simscen.spec.base import Spec
from simscen.spec.places import Name
from simscen.spec.quantities import Duration


class Latency(Spec):
    """Computing times of the parts of a stack, rounded to physics ticks.

    A part uses the data at the start of its computation; its result is available after this time. Parts run in
    parallel, as Nav2's servers do; a part that is still busy is not started again.
    """

    localizer: Duration = 0.0
    """Time from a scan to the pose correction; odometry updates the pose in the meantime."""
    costmap: Duration = 0.0
    """Time from sensor data to the updated costmaps."""
    planner: Duration = 0.0
    """Time from a request to the plan; the controller follows the previous plan in the meantime."""
    controller: Duration = 0.0
    """Time from pose and costmap to the command."""
    collision_monitor: Duration = 0.0
    """Time from the command of the controller to the command that is sent to the base."""


class RobotLatency(Latency):
    """Computing times on the robot's usual computer, and usual delays of its sensors.

    Used by scenarios with `stack: {latency: robot}`.
    """

    sensors: Annotated[dict[Name, Duration], Field(max_length=100)] = {}
    """Delays by sensor name, instead of the `latency` of the sensor."""
