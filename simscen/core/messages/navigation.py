"""Goals, paths, results (with the names and numbers of Nav2), and the belief of a localizer."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum, IntEnum
from typing import Literal

import numpy as np

from simscen.core.decorators import fast_dataclass
from simscen.core.geometry import Array, Pose2

RecoveryBehavior = Literal["clear_costmap", "spin", "wait", "backup", "retrace"]
"""The behaviors of a recovery, with Nav2's names."""

ReplanReason = Literal["blocked", "missed", "tight", "better", "window", "recovery", "rate"]
"""Why a plan is made anew while its goal stays: it is blocked, the robot has left it, an obstacle came too near to it,
obstacles went away, the rolling window moved on, after a recovery, or it was time."""


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
"""ComputePathThroughPoses and NavigateThroughPoses number what the actions of one pose do, 100 higher."""


def error_code(number: int) -> ErrorCode | int:
    """The code of a number, by the name that one pose and several share; the number itself where it has no name."""
    number = _THROUGH_POSES.get(number, number)
    return ErrorCode(number) if number in {int(code) for code in ErrorCode} else number


class TaskResult(str, Enum):
    """How a navigation task ended; nav2_simple_commander's names."""

    UNKNOWN = "UNKNOWN"
    SUCCEEDED = "SUCCEEDED"
    CANCELED = "CANCELED"
    FAILED = "FAILED"


@fast_dataclass()
class Goal:
    """A pose to reach in the map frame, within tolerances (m, rad), in at most `timeout` simulated seconds.

    `via`: it is passed within its tolerance without a stop, whatever the heading, on the way to the goal after it, in
    one plan (Nav2's NavigateThroughPoses). `wait`: simulated seconds to stay there (Nav2's WaitAtWaypoint).
    """

    name: str
    pose: Pose2
    xy_tolerance: float = 0.25
    yaw_tolerance: float = 0.25
    timeout: float | None = None
    via: bool = False
    wait: float = 0.0

    def at(self, pose: Pose2) -> Goal:
        """The same goal elsewhere, or in another frame."""
        return Goal(self.name, pose, self.xy_tolerance, self.yaw_tolerance, self.timeout, self.via, self.wait)


@fast_dataclass(eq=False)
class Path:
    """A planned path: `points` (n, 3) x, y, yaw in the map frame, made at `tick`."""

    points: Array = field(default_factory=lambda: np.empty((0, 3)))
    tick: int = 0

    def length(self) -> float:
        """Length in meters."""
        return float(np.hypot(*np.diff(self.points[:, :2], axis=0).T).sum()) if len(self.points) > 1 else 0.0


@dataclass(frozen=True, eq=False)
class Estimate:
    """What a localizer is told at the start: `pose` with standard deviations (m, m, rad); None = anywhere."""

    pose: Pose2 | None
    std: tuple[float, float, float] = (0.5, 0.5, 0.2618)


@fast_dataclass(eq=False)
class Belief:
    """A localizer's answer: `pose` in the map frame and its covariance (3, 3) over (x, y, yaw).

    `map_from_odom` is the correction it publishes on /tf. `particles` (n, 4) holds x, y, yaw, weight where there are
    any. `updated` is the tick of the newest measurement that changed it.
    """

    pose: Pose2
    covariance: Array
    map_from_odom: Pose2 = Pose2(0.0, 0.0, 0.0)
    particles: Array = field(default_factory=lambda: np.empty((0, 4)))
    updated: int = 0
