"""Base classes of the specifications of stacks and controllers, and computing times (latencies) of stacks."""

from typing import Annotated

from pydantic import Field

from simscen.spec.base import Spec, Typed, by_default
from simscen.spec.places import MaskFile, Name, RegionName, SpeedMask
from simscen.spec.quantities import Duration, Frequency, PositiveAngle, PositiveLength, PositiveSpeed, Quantity


class GoalTolerances(Spec):
    """Tolerances of goals that have no tolerances of their own. The stack and criteria use them."""

    xy_goal_tolerance: PositiveLength = 0.25
    """Distance from the goal within which the goal counts as reached."""
    yaw_goal_tolerance: PositiveAngle = 0.25
    """Heading error within which the goal counts as reached."""


class SpeedZone(Spec):
    """Region with a speed limit (nav2_costmap_2d's SpeedFilter)."""

    region: RegionName
    """Name of a region of the world."""
    speed_limit: PositiveSpeed
    """Speed limit while the robot's estimated position is in the region."""


class StackBase(Spec):
    """Base class of stack specifications, with the parameters that the simulation and the criteria use."""

    controller_frequency: Frequency = 20.0
    """Rate at which the stack computes commands."""
    goal_checker: GoalTolerances = by_default()
    """Tolerances of goals that have no tolerances of their own."""
    keepout: Annotated[list[RegionName], Field(max_length=100)] = []
    """Regions of the world that the robot must not enter (nav2_costmap_2d's KeepoutFilter)."""
    speed_zones: Annotated[list[SpeedZone], Field(max_length=100)] = []
    """Regions of the world with a speed limit."""
    keepout_mask: MaskFile | None = None
    """Map YAML file of a filter mask whose occupied cells are lethal in the costmap (nav2_costmap_2d's KeepoutFilter).
    """
    speed_mask: SpeedMask | None = None
    """Filter mask of speed limits."""

    @property
    def gets_ground_truth(self) -> bool:
        """Whether the stack receives the true pose."""
        return False


Weight = Annotated[float, Field(ge=0, le=1e7)]
"""Weight of a critic relative to other critics."""
Deceleration = Annotated[float, Field(ge=-1000, lt=0), Quantity("acceleration")]
"""Deceleration as a negative acceleration, as in Nav2."""


class ControllerSpec(Typed):
    """Base class of controller specifications."""

    @property
    def lookahead_s(self) -> float:
        """Time in s for which the controller looks ahead. It determines the default size of the local costmap."""
        return 2.0


class PathFollowerSpec(ControllerSpec):
    """Base class of the specifications of the shipped controllers, which follow a path."""

    goal_tolerance_ratio: Annotated[float, Field(gt=0, le=1), Quantity("ratio")] = 0.45
    """Fraction of the goal's `xy_goal_tolerance` within which the robot stops driving and turns to the goal's heading
    (Nav2: 1)."""
    max_robot_pose_search_dist: PositiveLength = 1.5
    """Length of the part of the plan in which the point nearest to the robot is searched. The part begins at the
    previous nearest point (Nav2: half the size of the local costmap)."""


class Latency(Spec):
    """Computing times of the parts of a stack, rounded to physics ticks.

    The result of a part is available after its computing time. Parts run in parallel, as Nav2's servers do. A part is
    not started again while it is still computing.
    """

    localizer: Duration = 0.0
    """Time from a scan to the pose correction. Odometry updates the pose in the meantime."""
    costmap: Duration = 0.0
    """Time from sensor data to the updated costmaps."""
    planner: Duration = 0.0
    """Time from a request to the plan. The controller follows the previous plan in the meantime."""
    controller: Duration = 0.0
    """Time from pose and costmap to the command."""
    collision_monitor: Duration = 0.0
    """Time from the command of the controller to the command that is sent to the base."""


class RobotLatency(Latency):
    """Computing times on a robot, and delays of its sensors, for scenarios with `stack: {latency: robot}`."""

    sensors: Annotated[dict[Name, Duration], Field(max_length=100)] = {}
    """Delays by sensor name. They replace the `latency` of the sensors."""
