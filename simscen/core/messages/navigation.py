"""Paths, pose estimates, and results of navigation, with the names and error codes of Nav2."""

from __future__ import annotations

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
- `better`: The planner has found a better plan.
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


@fast_dataclass(eq=False)
class Path:
    """Planned path: `points` (n, 3) are x, y, yaw in the map frame, and `tick` is the time of planning."""

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
