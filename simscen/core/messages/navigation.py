"""Goals, paths, beliefs, and results of navigation, with the names and error codes of Nav2."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from enum import Enum, IntEnum
from typing import Literal

import numpy as np

from simscen.core.decorators import fast_dataclass
from simscen.core.geometry import Array, Pose2

RecoveryBehavior = Literal["clear_costmap", "spin", "wait", "backup", "retrace"]
"""Recovery behavior; `retrace` is one of simscen, the others have Nav2's names."""

ReplanReason = Literal["blocked", "missed", "tight", "better", "window", "recovery", "rate"]
"""Reason for a new plan to the same goal.

In this order: the old plan is blocked, the robot has left it, an obstacle is too close to it, a better plan is
possible, the rolling window has moved, a recovery has ended, or the planning period has passed.
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


_THROUGH_POSES = {**{code + 100: code for code in range(200, 209)}, **{code + 100: code for code in range(9000, 9004)}}
"""ComputePathThroughPoses and NavigateThroughPoses use the codes of the actions for one pose plus 100."""


def error_code(number: int) -> ErrorCode | int:
    """Return Nav2's error code with this number, or the number itself if ErrorCode does not contain it.

    For an error of an action through several poses, return the code of the same error of the action to one pose.
    """
    number = _THROUGH_POSES.get(number, number)
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

    `timeout` is the maximum simulated time in s; None for no limit. A `via` goal is only passed: without a stop, with
    any heading, and in one plan with the next goal (Nav2's NavigateThroughPoses). `wait` is the simulated time in s for
    which the robot stays at the goal (Nav2's WaitAtWaypoint).
    """

    name: str
    pose: Pose2
    xy_tolerance: float = 0.25
    yaw_tolerance: float = 0.25
    timeout: float | None = None
    via: bool = False
    wait: float = 0.0

    def at(self, pose: Pose2) -> Goal:
        """Return the same goal with another pose, for example in another frame."""
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
    """Initial estimate for a localizer.

    `pose` is in the map frame; None if the robot can be anywhere on the map. `std` are the standard deviations of x, y
    (m) and yaw (rad).
    """

    pose: Pose2 | None
    std: tuple[float, float, float] = (0.5, 0.5, 0.2618)


@fast_dataclass(eq=False)
class Belief:
    """Output of a localizer: the estimated `pose` in the map frame and its covariance (3, 3) over x, y (m), yaw (rad).

    `map_from_odom` is the transform that the localizer publishes on /tf. `particles` (n, 4) are x, y, yaw, weight;
    empty for a localizer without particles. `updated` is the tick of the newest measurement that the estimate uses.
    """

    pose: Pose2
    covariance: Array
    map_from_odom: Pose2 = Pose2(0.0, 0.0, 0.0)
    particles: Array = field(default_factory=lambda: np.empty((0, 4)))
    updated: int = 0


Mode = Literal["navigate_to_pose", "navigate_through_poses", "follow_waypoints"]
"""Nav2's navigation actions: one goal after the other, all goals in one drive, or waypoints with a task at each."""

FAILED = "failed"
"""Value of `expect` for a goal that must fail, no matter with which error code."""


def loop_goal_name(name: str, loop: int) -> str:
    """Return the name of a goal in a loop over the list of goals: `shelf` in loop 1, `shelf#2` in loop 2."""
    return name if loop == 1 else f"{name}#{loop}"


LOOP_NAME = re.compile(r"(.+)#[0-9]+")
"""Pattern of `loop_goal_name` for loops after the first."""


def matches_goal_name(name: str, requested: str | None) -> bool:
    """Return whether the goal `name` is meant by `requested`.

    A request of `shelf` means the goal in every loop, `shelf#2` only in the second loop, and None any goal.
    """
    if requested is None or name == requested:
        return True
    loop = LOOP_NAME.fullmatch(name)
    return loop is not None and loop[1] == requested
