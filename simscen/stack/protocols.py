"""Protocols of a navigation stack and its components, with the data that they exchange.

You can implement each protocol in a package of your own. Contracts are written as *given … then …*; tests/contracts
checks them for every implementation. These contracts apply to all protocols:

- *Given* the same calls and random generators *then* the results are bit-identical. So the component uses no wall
  clock and no global random generator.
- *Given* arguments of a call *then* the component does not change them, neither during the call nor later.
- *Given* a failure *then* it raises NavigationFailure with one of Nav2's error codes, and no other exception.
"""

from dataclasses import dataclass, field, replace
from typing import Protocol, TypeGuard, runtime_checkable

import numpy as np
import numpy.typing as npt

from simscen.core.decorators import fast_dataclass
from simscen.core.environment.costmap_filters import FilterMasks, Zones
from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.environment.world_model import Polygon
from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.navigation import Belief, ErrorCode, Estimate, Goal, Path
from simscen.core.messages.sensor_data import Imu, Odometry, Readings, Scan
from simscen.core.records.trace import Decision
from simscen.stack.moving_obstacles import NO_MOVING_OBSTACLES, MovingObstacles


class NavigationFailure(Exception):
    """A component failed; `code` is one of Nav2's error codes."""

    def __init__(self, code: ErrorCode, message: str) -> None:
        """Take the error code and a message for logs and reports."""
        self.code = code
        super().__init__(message)


@dataclass(frozen=True)
class RobotModel:
    """Description of the robot for its stack, in SI units.

    `footprint` contains the corners in the base frame, counterclockwise. For a round robot, it is a regular polygon,
    and `radius` is not None. Speeds and accelerations are limits of the base. `turning_radius` is the minimum turning
    radius, 0 for a base that turns in place. A `holonomic` base can drive sideways.
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
        corners = np.array(self.footprint)
        ends = np.roll(corners, -1, axis=0)
        normal = np.column_stack((ends[:, 1] - corners[:, 1], corners[:, 0] - ends[:, 0]))
        distance = np.abs(np.sum(normal * corners, axis=1)) / np.hypot(*normal.T)
        return self.radius if self.radius is not None else float(distance.min())

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
        """Restart at an initial pose estimate. The next odometry reading is the new reference."""
        ...

    def on_odometry(self, odometry: Odometry) -> None:
        """Process an odometry reading. Several can arrive before `belief` is read."""
        ...

    def on_scan(self, scan: Scan) -> None:
        """Process a lidar scan. A localizer may ignore it until the robot has moved enough."""
        ...

    def on_imu(self, imu: Imu) -> None:
        """Process an IMU reading."""
        ...

    @property
    def belief(self) -> Belief:
        """The current estimate: the last correction, extrapolated by odometry."""
        ...


class SupportsPose(Protocol):
    """Optional extension of a localizer: the pose without covariance and particles, which costs less.

    The controller needs the pose at each step; the complete belief is published less often.
    """

    @property
    def pose(self) -> Pose2:
        """Exactly the pose of `belief`."""
        ...


def supports_pose(localizer: object) -> TypeGuard[SupportsPose]:
    """Return whether a localizer has `pose`. Checks the class, because reading the property may compute the pose."""
    return hasattr(type(localizer), "pose")


LETHAL = 254
"""Cost of an obstacle in nav2_costmap_2d."""


@fast_dataclass(eq=False)
class CostmapView:
    """A costmap at one time: for planners the global one in the map frame, for the others the local one (odom frame).

    Poses, paths, and goals in the same call are in the frame of the costmap.

    `costs` (height, width) uint8 has nav2_costmap_2d's values (0 free, 253 inscribed, 254 lethal, 255 unknown). Row 0
    has the lowest y; `origin` is the corner of cell (0, 0) without rotation. `distance` (height, width) float32 is the
    distance in m from the center of each cell to the center of the nearest lethal cell. Distances beyond the inflation
    radius and half a meter beyond the footprint may be cut off. `resolution` is the cell size in m. `revision`
    increases with each change. `inflation_radius` is the distance in m up to which obstacles increase costs. The arrays
    may be views of a live costmap and are valid until its next update.

    `moving` contains the moving obstacles in this frame that motion prediction has found; `Footprint.gap` returns the
    distance to them. It is empty without prediction. Moving obstacles do not affect the costs, except in the view for a
    planner, where cells cost more if the robot would meet an obstacle there.
    """

    costs: npt.NDArray[np.uint8]
    distance: npt.NDArray[np.float32]
    resolution: float
    origin: tuple[float, float]
    revision: int = 0
    inflation_radius: float = 0.55
    moving: MovingObstacles = NO_MOVING_OBSTACLES

    def with_grown_obstacles(self, meters: float) -> "CostmapView":
        """Return a copy with every obstacle enlarged by `meters` in all directions."""
        costs = np.where(self.distance <= meters, np.uint8(LETHAL), self.costs)
        return replace(self, costs=costs, distance=np.maximum(self.distance - np.float32(meters), np.float32(0)))


class Planner(Protocol):
    """Finds a path on a costmap.

    *Given* a start or goal outside the map or in an obstacle *then* it fails at once, for example with GOAL_OCCUPIED.
    *Given* that no path exists *then* it fails with NO_VALID_PATH after a bounded number of iterations.
    *Given* success *then* the path starts at `start`, ends within `tolerance` of `goal`, and the footprint is on no
    lethal cell at any of its points.
    """

    def plan(self, costmap: CostmapView, start: Pose2, goal: Pose2, seed: int) -> Path:
        """Return a path of poses in the map frame, at most 0.1 m apart. `seed` is for its random generator, if any."""
        ...


class Controller(Protocol):
    """Follows a path. All inputs are in the odom frame like the local costmap, because that frame is continuous.

    *Given* limits of the robot and its speed *then* no command exceeds them. *Given* an obstacle on the arc that it
    would drive *then* it fails with NO_VALID_CONTROL.
    """

    def set_path(self, path: Path) -> None:
        """Follow this path from now on.

        The path is new, or it is the part of the current path ahead of the robot, after the transform between map and
        odom frame has changed.
        """
        ...

    @property
    def full_speed(self) -> float:
        """Maximum speed in m/s while no speed limit is set."""
        ...

    def set_speed_limit(self, limit: float | None) -> None:
        """Set the speed limit in m/s; None removes it."""
        ...

    def command(self, pose: Pose2, twist: Twist, costmap: CostmapView, goal: Goal) -> Twist:
        """Return the velocity command for the current pose and velocity. Called at a fixed rate."""
        ...

    @property
    def local_plan(self) -> Path | None:
        """The expected trajectory, for the log."""
        ...


@runtime_checkable
class SupportsArc(Protocol):
    """Optional extension of a controller whose local plan is an arc at constant velocity, which is faster to log."""

    @property
    def arc(self) -> tuple[Pose2, Twist] | None:
        """Pose and velocity of the last command; None before the first."""
        ...


class Behavior(Protocol):
    """A recovery behavior such as spin, called until it is done. Poses are in the odom frame."""

    name: str

    def start(self, pose: Pose2) -> None:
        """Start the behavior at this pose."""
        ...

    def step(self, pose: Pose2, costmap: CostmapView, seconds: float) -> Twist | None:
        """Return the velocity command, `seconds` after the start, or None when the behavior is done.

        Raises NavigationFailure if there is an obstacle or if it takes too long.
        """
        ...


class GoalChecker(Protocol):
    """Decides whether a goal is reached.

    *Given* a robot that stands still at the goal *then* it returns True within two seconds. *Given* a robot outside the
    goal's tolerances *then* it never does.
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
        """Replace all zones from the next costmap update on. Called before `decide` of the same tick."""
        ...


class Stack(Protocol):
    """A complete navigation stack: takes readings and returns one command per beat.

    *Given* no goal or an ended task *then* it commands zero. (A stack may still avoid a moving obstacle that would hit
    the robot, and return afterward, but not after a cancel.)
    """

    def start(self, estimate: Estimate, goals: tuple[Goal, ...]) -> None:
        """Initialize the localizer with the estimate and drive to the goals in order."""
        ...

    def preempt(self, tick: int, goal: Goal) -> None:
        """Drive to this goal first, like a new action goal. Called before `decide` of the same tick."""
        ...

    def cancel(self, tick: int) -> None:
        """Cancel the current goal and all after it. Called before `decide` of the same tick."""
        ...

    def decide(self, tick: int, readings: Readings) -> Decision:
        """Process the readings of this beat and return the command."""
        ...

    @property
    def plan(self) -> Path | None:
        """The plan being followed."""
        ...

    @property
    def goal(self) -> Goal | None:
        """The current goal; None when the task has ended."""
        ...


@dataclass(frozen=True, eq=False)
class Surroundings:
    """Robot and environment that a scenario configures for a stack. `tick_rate` is in Hz.

    `map` is None for mapless navigation. The robot must not enter `keepout` polygons (map frame); `speed_zones` are
    polygons with a speed limit in m/s; `masks` are the same as grids of cells. `lidars` are the names of the lidars
    that the localizer uses. `has_imu`: the robot has an IMU.
    """

    robot: RobotModel
    map: OccupancyGrid | None
    tick_rate: int
    keepout: tuple[Polygon, ...] = ()
    speed_zones: tuple[tuple[Polygon, float], ...] = ()
    masks: FilterMasks = field(default_factory=FilterMasks)
    lidars: tuple[str, ...] = field(default=())
    has_imu: bool = False
