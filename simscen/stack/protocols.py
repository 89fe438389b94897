"""Protocols of a navigation stack and its components, with the data that they exchange.

You can implement each protocol in a package of your own. Contracts are written as *given … then …*. The tests in
tests/contracts check the contracts for each implementation. These contracts apply to all protocols:

- *Given* the same calls and random generators *then* the results are bit-identical. A component must therefore use
  neither the wall clock nor a global random generator.
- *Given* arguments of a call *then* the component does not change them, neither during the call nor later.
- *Given* a failure *then* the component raises NavigationFailure with one of Nav2's error codes, and no other
  exception.
"""

from dataclasses import dataclass, field, replace
from typing import Protocol, runtime_checkable

import numpy as np
import numpy.typing as npt

from simscen.core.decorators import fast_dataclass
from simscen.core.environment.costmap_filters import FilterMasks, Zones
from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.geometry import Polygon, Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.geometry.polygons import inscribed_radius
from simscen.core.messages.goals import Goal
from simscen.core.messages.navigation import Belief, ErrorCode, Estimate, Path
from simscen.core.messages.sensor_data import Imu, Odometry, Readings, Scan
from simscen.core.records.trace import Decision
from simscen.stack.moving_obstacles import NO_MOVING_OBSTACLES, MovingObstacles


class NavigationFailure(Exception):
    """Exception for the failure of a component. `code` is one of Nav2's error codes."""

    def __init__(self, code: ErrorCode, message: str) -> None:
        """Take the error code and a message for logs and reports."""
        self.code = code
        super().__init__(message)


@dataclass(frozen=True)
class RobotModel:
    """Description of the robot for its stack, in SI units and rad.

    footprint:       corners in the base frame, counterclockwise; a regular polygon for a round robot
    radius:          radius of a round robot; None for other robots
    max_…:           maximum speeds of the base: forward, backward, to the side, and turn rate
    linear_…:        maximum acceleration and deceleration of the base
    turning_radius:  minimum turning radius; 0 for a base that turns in place
    holonomic:       whether the base can drive sideways
    """

    footprint: Polygon
    radius: float | None
    max_linear: float
    max_reverse: float
    max_lateral: float
    max_angular: float
    linear_acceleration: float
    linear_deceleration: float
    angular_acceleration: float
    turning_radius: float = 0.0
    holonomic: bool = False

    @property
    def inscribed_radius(self) -> float:
        """Radius in m of the largest circle around the origin of the base inside the footprint."""
        return self.radius if self.radius is not None else inscribed_radius(self.footprint)

    @property
    def circumscribed_radius(self) -> float:
        """Radius in m of the smallest circle around the origin of the base that contains the footprint."""
        return self.radius if self.radius is not None else float(np.hypot(*np.array(self.footprint).T).max())


class Localizer(Protocol):
    """Estimates the pose of the robot on the map.

    *Given* no motion and perfect readings *then* the belief does not drift.
    *Given* blind, wrong, or NaN readings *then* the belief stays finite and its covariance symmetric and positive
    semidefinite.
    """

    def reset(self, estimate: Estimate) -> None:
        """Restart at an initial pose estimate. Motion is measured from the next odometry reading on."""
        ...

    def on_odometry(self, odometry: Odometry) -> None:
        """Process an odometry reading. Several readings can arrive before `belief` is read."""
        ...

    def on_scan(self, scan: Scan) -> None:
        """Process a lidar scan. A localizer may ignore scans until the robot has moved far enough."""
        ...

    def on_imu(self, imu: Imu) -> None:
        """Process an IMU reading."""
        ...

    @property
    def belief(self) -> Belief:
        """The current estimate: the last correction, extrapolated by odometry."""
        ...


@runtime_checkable
class SupportsPose(Protocol):
    """Optional extension of a localizer: the estimated pose alone, which is faster to compute than the belief.

    The stack needs the pose in each control period. It publishes the complete belief less often.
    """

    @property
    def pose(self) -> Pose2:
        """The same pose as in `belief`."""
        ...


FREE, MAX_NON_OBSTACLE, INSCRIBED, LETHAL, NO_INFORMATION = 0, 252, 253, 254, 255
"""Costs of nav2_costmap_2d (cost_values.hpp)."""


@fast_dataclass(eq=False)
class CostmapView:
    """State of a costmap. Planners get the global costmap, controllers and behaviors get the local costmap.

    The global costmap is in the map frame, the local costmap in the odom frame. Poses, paths, and goals in the same
    call are in the frame of the costmap. The arrays are valid until the next update of the costmap.

    costs:             costs (height, width) as in nav2_costmap_2d: 0 free, 253 inscribed, 254 lethal, 255 unknown
    distance:          distances (height, width) in m from the center of each cell to the center of the nearest lethal
                       cell. Distances are at most the inflation radius or, if this is larger, the circumscribed radius
                       plus 0.5 m.
    resolution:        cell size in m
    origin:            corner (x, y) of cell (0, 0), which has the lowest x and y
    revision:          number that increases with each change
    inflation_radius:  distance in m up to which obstacles increase costs
    moving:            moving obstacles with predicted positions (see `Footprint.gap`); empty without motion prediction.
                       Only in the costmap for a planner, `costs` contain moving obstacles: at the positions where the
                       robot would meet them.
    """

    costs: npt.NDArray[np.uint8]
    distance: npt.NDArray[np.float32]
    resolution: float
    origin: tuple[float, float]
    revision: int = 0
    inflation_radius: float = 0.55
    moving: MovingObstacles = NO_MOVING_OBSTACLES

    def with_grown_obstacles(self, meters: float) -> "CostmapView":
        """Return a copy with all lethal cells enlarged by `meters` in all directions."""
        costs = np.where(self.distance <= meters, np.uint8(LETHAL), self.costs)
        return replace(self, costs=costs, distance=np.maximum(self.distance - np.float32(meters), np.float32(0)))


class Planner(Protocol):
    """Finds a path on a costmap.

    *Given* a start or goal outside the map or in an obstacle *then* the planner fails at once, for example with
    GOAL_OCCUPIED.
    *Given* that no path exists *then* the planner fails with NO_VALID_PATH after a bounded number of iterations.
    *Given* success *then* the path starts at `start` and ends within the planner's tolerance of `goal`. At each pose of
    the path, the footprint contains no lethal cell.
    """

    def plan(self, costmap: CostmapView, start: Pose2, goal: Pose2, seed: int) -> Path:
        """Return a path of poses in the map frame, at most 0.1 m apart. `seed` is the seed for a random generator."""
        ...


class Controller(Protocol):
    """Follows a path. All inputs are in the odom frame, because this frame is continuous.

    *Given* velocity limits of the robot and a speed limit *then* no command exceeds them.
    *Given* an obstacle *then* the command causes no collision, or the controller fails with NO_VALID_CONTROL.
    """

    def set_path(self, path: Path) -> None:
        """Follow this path from now on.

        When the transform from map to odom frame has changed, the stack passes the remaining part of the path again.
        """
        ...

    @property
    def full_speed(self) -> float:
        """Maximum speed in m/s while no speed limit is set."""
        ...

    def set_speed_limit(self, limit: float | None) -> None:
        """Set the speed limit in m/s; None removes the limit."""
        ...

    def command(self, pose: Pose2, twist: Twist, costmap: CostmapView, goal: Goal) -> Twist:
        """Return the velocity command for the current pose and velocity. Called at a fixed rate."""
        ...

    @property
    def local_plan(self) -> Path | None:
        """The trajectory that the controller expects to drive, for the log; None if there is none."""
        ...


@runtime_checkable
class SupportsArc(Protocol):
    """Optional extension of a controller that drives along arcs: logging an arc is faster than logging a path."""

    @property
    def arc(self) -> tuple[Pose2, Twist] | None:
        """Start pose and constant velocity of the arc of the last command; None before the first command."""
        ...


class Behavior(Protocol):
    """A recovery behavior such as spin. The stack calls `step` until it returns None. Poses are in the odom frame."""

    name: str
    """Name of the behavior in events and logs."""

    def start(self, pose: Pose2) -> None:
        """Start the behavior at this pose."""
        ...

    def step(self, pose: Pose2, costmap: CostmapView, seconds: float) -> Twist | None:
        """Return the velocity command, `seconds` after the start; None when the behavior is done.

        Raises NavigationFailure if an obstacle is in the way, or if the behavior takes too long.
        """
        ...


class GoalChecker(Protocol):
    """Decides whether a goal is reached.

    *Given* a robot that stands still at the goal *then* `reached` returns True within two seconds.
    *Given* a robot outside the goal's tolerances *then* `reached` returns False.
    """

    def reset(self) -> None:
        """Prepare for a new goal."""
        ...

    def reached(self, goal: Goal, pose: Pose2, twist: Twist) -> bool:
        """Return whether the goal is reached, given the estimated pose in the map frame and the velocity."""
        ...


class SupportsZones(Protocol):
    """Optional extension of a stack whose costmap filters can change during a run."""

    def set_zones(self, tick: int, zones: Zones) -> None:
        """Replace all keepout and speed zones at the next costmap update. Called before `decide` of the same tick."""
        ...


class Stack(Protocol):
    """A complete navigation stack: takes the readings of each tick, and returns a velocity command.

    *Given* no goal or an ended task *then* the stack commands a stop. Exception: if the task was not canceled, the
    robot may move out of the way of an obstacle and return.
    """

    def start(self, estimate: Estimate, goals: tuple[Goal, ...]) -> None:
        """Initialize the localizer with the estimate, and drive to the goals in order."""
        ...

    def preempt(self, tick: int, goal: Goal) -> None:
        """Replace the current goal, as Nav2 does for a new action goal. Called before `decide` of the same tick."""
        ...

    def cancel(self, tick: int) -> None:
        """Cancel the current goal and all after it. Called before `decide` of the same tick."""
        ...

    def decide(self, tick: int, readings: Readings) -> Decision:
        """Process the readings that arrive at this tick, and return the command and other output."""
        ...

    @property
    def plan(self) -> Path | None:
        """The plan being followed; None without a plan."""
        ...

    @property
    def goal(self) -> Goal | None:
        """The current goal; None when the task has ended."""
        ...


@dataclass(frozen=True, eq=False)
class Surroundings:
    """Robot and environment of a stack.

    robot:        footprint and limits of the robot
    map:          map for localization and planning; None for mapless navigation
    tick_rate:    number of physics steps per second
    keepout:      polygons in the map frame that the robot must not enter
    speed_zones:  polygons in the map frame, each with a speed limit in m/s
    masks:        keepout and speed zones as grids of cells (filter masks of Nav2)
    lidars:       names of the lidars that the localizer uses
    has_imu:      whether the stack gets readings of an IMU
    """

    robot: RobotModel
    map: OccupancyGrid | None
    tick_rate: int
    keepout: tuple[Polygon, ...] = ()
    speed_zones: tuple[tuple[Polygon, float], ...] = ()
    masks: FilterMasks = field(default_factory=FilterMasks)
    lidars: tuple[str, ...] = ()
    has_imu: bool = False
