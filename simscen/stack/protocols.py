"""The roles of a navigation stack and what each promises. Anybody's own component can take a place.

Promises are written as *given … then …* and tested in tests/contracts on every implementation. Three hold for all:

- *Given* the same calls with the same generators *then* bit-identical answers: no clock, no global chance.
- *Given* data in a call *then* it is neither changed nor kept to be changed later.
- *Given* a failure *then* a NavigationFailure with one of Nav2's codes, never another exception.
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
    """A component cannot do what it was asked; `code` says why in Nav2's terms."""

    def __init__(self, code: ErrorCode, message: str) -> None:
        self.code = code
        super().__init__(message)


@dataclass(frozen=True)
class RobotModel:
    """What a stack knows of its own robot: a datasheet, in SI units.

    `footprint` are the corners of the hull in the base frame, anticlockwise (a regular polygon for a round robot,
    then `radius` is set). Speeds are limits of the base. `turning_radius` is 0 for a base that turns in place.
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
        """The largest circle around the base's origin inside the footprint."""
        corners = np.array(self.footprint)
        ends = np.roll(corners, -1, axis=0)
        normal = np.column_stack((ends[:, 1] - corners[:, 1], corners[:, 0] - ends[:, 0]))
        distance = np.abs(np.sum(normal * corners, axis=1)) / np.hypot(*normal.T)
        return self.radius if self.radius is not None else float(distance.min())

    @property
    def circumscribed_radius(self) -> float:
        """The smallest circle around the base's origin that holds the footprint."""
        return self.radius if self.radius is not None else float(np.hypot(*np.array(self.footprint).T).max())


class Localizer(Protocol):
    """Knows where the robot is on the map.

    *Given* no motion and perfect readings *then* the belief does not wander off.
    *Given* a sensor that is blind, lying or full of nan *then* the belief stays finite and its covariance symmetric
    and positive semidefinite.
    """

    def reset(self, estimate: Estimate) -> None:
        """Start over at an estimate; the next odometry is the new reference."""
        ...

    def on_odometry(self, odometry: Odometry) -> None:
        """Take a step of dead reckoning; several may come one after the other before anybody asks for the belief."""
        ...

    def on_scan(self, scan: Scan) -> None:
        """Correct with a lidar scan; may do nothing until the robot has moved enough."""
        ...

    def on_imu(self, imu: Imu) -> None:
        """Take a turn rate."""
        ...

    @property
    def belief(self) -> Belief:
        """The estimate now: the last correction carried on by odometry."""
        ...


class SupportsPose(Protocol):
    """What a localizer that ships can do besides: say where the robot is, and not how sure that is.

    That is asked at each step of the controller, and half as often published.
    """

    @property
    def pose(self) -> Pose2:
        """That of the belief, to the last digit."""
        ...


def supports_pose(localizer: object) -> TypeGuard[SupportsPose]:
    """Whether a localizer does. Its class is asked: it would itself work the pose out, of particles anywhere in ms."""
    return hasattr(type(localizer), "pose")


LETHAL = 254
"""nav2_costmap_2d's cost of an obstacle."""


@fast_dataclass(eq=False)
class CostmapView:
    """A costmap at a moment: the global one in the map frame, which planners see, or the local one in the odom frame.

    Poses, paths and goals that come with it are in its frame.

    `costs` (height, width) uint8 with nav2_costmap_2d's values (0 free, 253 inscribed, 254 lethal, 255 unknown);
    row 0 is the lowest y, `origin` is the corner of cell (0, 0), without rotation. `distance` (height, width) float32
    is the distance in meters from each cell's center to the nearest lethal cell's center; a costmap may cap it, at no
    less than the inflation radius and half a meter beyond the hull. `revision` grows with each
    change; `inflation_radius` is how far in meters an obstacle's costs reach. The arrays may be windows on a costmap
    that goes on living: they hold until its next update.

    `moving` is what motion prediction says of things that move, now and in this frame; `Footprint.gap` says how near a
    robot will come to them. Empty where nothing moves and where nobody predicts. Nothing of them is in the costs, but
    for the view that a planner is shown: there, cells are dearer at which a robot would meet them.
    """

    costs: npt.NDArray[np.uint8]
    distance: npt.NDArray[np.float32]
    resolution: float
    origin: tuple[float, float]
    revision: int = 0
    inflation_radius: float = 0.55
    moving: MovingObstacles = NO_MOVING_OBSTACLES

    def with_less_room(self, meters: float) -> "CostmapView":
        """The same place with every obstacle so much larger all round."""
        costs = np.where(self.distance <= meters, np.uint8(LETHAL), self.costs)
        return replace(self, costs=costs, distance=np.maximum(self.distance - np.float32(meters), np.float32(0)))


class Planner(Protocol):
    """Finds a path on a costmap.

    *Given* a start or a goal off the map or in an obstacle *then* fails at once with its code.
    *Given* no way *then* fails with NO_VALID_PATH after a bounded number of iterations.
    *Given* success *then* the path begins at `start`, ends within `tolerance` of `goal`, and no point of it puts the
    footprint on a lethal cell.
    """

    def plan(self, costmap: CostmapView, start: Pose2, goal: Pose2, seed: int) -> Path:
        """A path of poses in the map frame, at most 0.1 m apart."""
        ...


class Controller(Protocol):
    """Follows a path. All that it is told is in the odom frame, in which the local costmap is: there nothing jumps.

    *Given* limits *then* no command exceeds them. *Given* an obstacle on the arc it is about to drive *then* fails
    with NO_VALID_CONTROL rather than drive into it.
    """

    def set_path(self, path: Path) -> None:
        """Follow this path from now on.

        It is a new one, or the rest of the one it follows, where the localizer has found that to be in the odom frame.
        """
        ...

    @property
    def full_speed(self) -> float:
        """What it drives at in m/s where nothing limits it."""
        ...

    def set_speed_limit(self, limit: float | None) -> None:
        """Drive no faster than this in m/s from now on; None lifts the limit (a speed zone was left)."""
        ...

    def command(self, pose: Pose2, twist: Twist, costmap: CostmapView, goal: Goal) -> Twist:
        """The velocity to drive now, given where the robot is and how it moves. Called at a fixed rate."""
        ...

    @property
    def local_plan(self) -> Path | None:
        """The arc it expects to drive, for the log."""
        ...


@runtime_checkable
class SupportsArc(Protocol):
    """What a controller that ships can do besides: say of which arc its local plan is the beginning.

    Nobody need place it point by point in another frame then.
    """

    @property
    def arc(self) -> tuple[Pose2, Twist] | None:
        """The pose and the velocity of its last command; None before there was any."""
        ...


class Behavior(Protocol):
    """A recovery behavior such as spin: asked again and again until it is done. Its poses are in the odom frame."""

    name: str

    def start(self, pose: Pose2) -> None:
        """Begin from this pose."""
        ...

    def step(self, pose: Pose2, costmap: CostmapView, seconds: float) -> Twist | None:
        """The velocity to drive now, `seconds` after the start; None when done.

        Raises NavigationFailure when it would hit something or takes too long.
        """
        ...


class GoalChecker(Protocol):
    """Says whether a goal is reached.

    *Given* a robot that stands on the goal *then* it says so within two seconds. *Given* one that is outside the goal's
    tolerances *then* it never does.
    """

    def reset(self) -> None:
        """A new goal: nothing of the last one counts."""
        ...

    def reached(self, goal: Goal, pose: Pose2, twist: Twist) -> bool:
        """Whether the robot, believed at `pose` in the map and moving at `twist`, has reached the goal."""
        ...


class SupportsZones(Protocol):
    """What a stack can do besides, whose costmap filters can be switched while it drives."""

    def set_zones(self, tick: int, zones: Zones) -> None:
        """Told at `tick`, before its `decide`: these hold from the next update of its costmap on, and no others."""
        ...


class Stack(Protocol):
    """A whole navigation stack: readings in, one command out, each beat.

    *Given* no goal *then* it commands zero. *Given* a task that has ended *then* it commands zero from that beat on.
    (But for stepping aside, and coming back, where something that moves would run into it. After a cancel it stays.)
    """

    def start(self, estimate: Estimate, goals: tuple[Goal, ...]) -> None:
        """Localize at the estimate, then drive to the goals in order."""
        ...

    def preempt(self, tick: int, goal: Goal) -> None:
        """Told at `tick`, before its `decide`: drive to this goal first, as a new action goal would make it."""
        ...

    def cancel(self, tick: int) -> None:
        """Told at `tick`, before its `decide`: cancel the current goal and all after it."""
        ...

    def decide(self, tick: int, readings: Readings) -> Decision:
        """Take the readings of this beat and say what to drive."""
        ...

    @property
    def plan(self) -> Path | None:
        """The plan being followed."""
        ...

    @property
    def goal(self) -> Goal | None:
        """The goal being driven to; None when the task has ended."""
        ...


@dataclass(frozen=True, eq=False)
class Surroundings:
    """What a stack is installed with: its robot, its map (None = mapless) and the ticks a second.

    `keepout` are polygons it must not enter, `speed_zones` polygons with a speed limit in m/s; `masks` say
    the same of cells.
    """

    robot: RobotModel
    map: OccupancyGrid | None
    tick_rate: int
    keepout: tuple[Polygon, ...] = ()
    speed_zones: tuple[tuple[Polygon, float], ...] = ()
    masks: FilterMasks = field(default_factory=FilterMasks)
    lidars: tuple[str, ...] = field(default=())
