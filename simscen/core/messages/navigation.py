"""Goals, paths, pose estimates, and results of navigation, with the names and error codes of Nav2."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from enum import Enum, IntEnum
from typing import Literal

import numpy as np

from simscen.core.decorators import fast_dataclass
from simscen.core.geometry import Array, Pose2

RecoveryBehavior = Literal["clear_costmap", "spin", "wait", "backup"]
"""Recovery behavior of the reference stack, with Nav2's name."""

ReplanReason = Literal["blocked", "missed", "tight", "better", "window", "recovery", "rate", "moving"]
"""Reason for a new plan to the same goal.

- `blocked`, `tight`: An obstacle is on the old plan, or too close to it.
- `missed`: The robot has left the old plan, or has passed its end without reaching all goals.
- `better`: A better plan exists.
- `window`: The rolling window of the global costmap has moved.
- `recovery`, `rate`: A recovery has ended, or the planning period has passed.
- `moving`: A predicted obstacle will be on the old plan (advanced stack).
"""


class ErrorCode(IntEnum):
    """Nav2's error codes (nav2_msgs actions, 2026)."""

    NONE = 0
    FOLLOW_PATH_UNKNOWN = 100
    TF_ERROR = 102
    INVALID_PATH = 103
    PATIENCE_EXCEEDED = 104
    FAILED_TO_MAKE_PROGRESS = 105
    NO_VALID_CONTROL = 106
    CONTROLLER_TIMED_OUT = 107
    PLANNER_UNKNOWN = 200
    START_OUTSIDE_MAP = 203
    GOAL_OUTSIDE_MAP = 204
    START_OCCUPIED = 205
    GOAL_OCCUPIED = 206
    PLANNER_TIMEOUT = 207
    NO_VALID_PATH = 208
    NO_VIAPOINTS_GIVEN = 309
    FOLLOW_WAYPOINTS_UNKNOWN = 600
    TASK_EXECUTOR_FAILED = 601
    NO_VALID_WAYPOINTS = 602
    STOP_ON_MISSED_WAYPOINT = 603
    SPIN_TIMEOUT = 701
    SPIN_COLLISION_AHEAD = 703
    BACKUP_TIMEOUT = 711
    BACKUP_INVALID_INPUT = 713
    BACKUP_COLLISION_AHEAD = 714
    NAVIGATE_UNKNOWN = 9000
    NAVIGATE_TIMEOUT = 9003


_SINGLE_POSE_CODES = {code + 100: code for code in (*range(200, 209), *range(9000, 9004))}
"""Error codes of …ToPose actions, by the code of the same error of the …ThroughPoses action."""


def error_code(number: int) -> ErrorCode | int:
    """Return the ErrorCode with this number, or the number itself if there is none.

    An error of a …ThroughPoses action gets the code of the same error of the …ToPose action.
    """
    number = _SINGLE_POSE_CODES.get(number, number)
    return ErrorCode(number) if number in {int(code) for code in ErrorCode} else number


class TaskResult(str, Enum):
    """Result of a navigation task, with the names of nav2_simple_commander."""

    UNKNOWN = "UNKNOWN"
    SUCCEEDED = "SUCCEEDED"
    CANCELED = "CANCELED"
    FAILED = "FAILED"


@fast_dataclass()
class Goal:
    """Pose in the map frame that the robot must reach within the tolerances (m, rad).

    `timeout` is the maximum simulated time in s; None for no limit. If `via`, the robot passes the pose with any
    heading and without a stop, as in Nav2's NavigateThroughPoses. `wait` is the simulated time in s for which the robot
    stays at the goal, as in Nav2's WaitAtWaypoint.
    """

    name: str
    pose: Pose2
    xy_tolerance: float = 0.25
    yaw_tolerance: float = 0.25
    timeout: float | None = None
    via: bool = False
    wait: float = 0.0

    def at(self, pose: Pose2) -> Goal:
        """Return the same goal with another pose."""
        return Goal(self.name, pose, self.xy_tolerance, self.yaw_tolerance, self.timeout, self.via, self.wait)


@fast_dataclass(eq=False)
class Path:
    """Planned path: `points` (n, 3) are x, y, yaw in the map frame; `tick` is the tick at which it was planned."""

    points: Array = field(default_factory=lambda: np.empty((0, 3)))
    tick: int = 0

    def length(self) -> float:
        """Return the length in m."""
        return float(np.hypot(*np.diff(self.points[:, :2], axis=0).T).sum()) if len(self.points) > 1 else 0.0


@dataclass(frozen=True, eq=False)
class Estimate:
    """Initial pose estimate for a localizer.

    `pose` is in the map frame; None if the robot can be anywhere on the map. `std` contains the standard deviations of
    x, y (m) and yaw (rad).
    """

    pose: Pose2 | None
    std: tuple[float, float, float] = (0.5, 0.5, 0.2618)


@fast_dataclass(eq=False)
class Belief:
    """Pose estimate of a localizer: the `pose` in the map frame and its covariance (3, 3) of x, y (m), yaw (rad).

    `map_from_odom` is the transform that the localizer publishes on /tf. `particles` (n, 4) are x, y, yaw, weight;
    empty for a localizer without particles. `updated` is the tick of the newest measurement in the estimate.
    """

    pose: Pose2
    covariance: Array
    map_from_odom: Pose2 = Pose2(0.0, 0.0, 0.0)
    particles: Array = field(default_factory=lambda: np.empty((0, 4)))
    updated: int = 0


Mode = Literal["navigate_to_pose", "navigate_through_poses", "follow_waypoints"]
"""Navigation action of Nav2: one goal at a time, all goals without a stop, or a list of waypoints with stops."""

FAILED = "failed"
"""Value of the YAML key `expect` for a goal that must fail, with any error code."""


def loop_goal_name(name: str, loop: int) -> str:
    """Return the name of a goal in a loop over the list of goals: `shelf` in loop 1, `shelf#2` in loop 2."""
    return name if loop == 1 else f"{name}#{loop}"


LOOP_GOAL_NAME = re.compile(r"(.+)#[0-9]+")
"""Pattern of the names that `loop_goal_name` returns for loops after the first."""


def matches_goal_name(name: str, requested: str | None) -> bool:
    """Return whether `requested` selects the goal `name`.

    `shelf` selects the goal in every loop, `shelf#2` only in the second loop, and None selects all goals.
    """
    if requested is None or name == requested:
        return True
    loop = LOOP_GOAL_NAME.fullmatch(name)
    return loop is not None and loop[1] == requested
