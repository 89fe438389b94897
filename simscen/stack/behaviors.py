"""Recovery behaviors (nav2_behaviors), and the sequence in which the navigator runs them."""

import math
from collections.abc import Sequence
from typing import get_args

from simscen.core.geometry import Pose2, wrap
from simscen.core.geometry.kinematics import STOP, Twist
from simscen.core.messages.navigation import ErrorCode
from simscen.model import recovery as model
from simscen.model.recovery import PlannerCode, Recovery
from simscen.stack.controllers.collision_checker import time_to_collision
from simscen.stack.protocols import Behavior, CostmapView, NavigationFailure
from simscen.stack.setting import Setting

SPIN_TOLERANCE_RAD = 0.01
"""Maximum remaining angle at which a spin is done: half a degree, the accuracy of odometry."""


class Spin:
    """Recovery behavior that turns in place by `spin_dist` rad, so that the lidar sees all surroundings."""

    name = "spin"

    def __init__(self, spec: model.Spin, setting: Setting) -> None:
        self._spec, self._robot, self._footprint = spec, setting.robot, setting.footprint
        self._deceleration = spec.rotational_acc_lim or setting.robot.angular_acceleration
        self._turned_angle, self._last_yaw = 0.0, 0.0

    def start(self, pose: Pose2) -> None:
        """Start at this pose."""
        self._turned_angle, self._last_yaw = 0.0, pose.yaw

    def step(self, pose: Pose2, costmap: CostmapView, seconds: float) -> Twist | None:
        """Return the command `seconds` after the start; None when done, and for a car, which cannot spin.

        Raises NavigationFailure with SPIN_COLLISION_AHEAD or SPIN_TIMEOUT.
        """
        self._turned_angle += wrap(pose.yaw - self._last_yaw)
        self._last_yaw = pose.yaw
        remaining = abs(self._spec.spin_dist) - math.copysign(1.0, self._spec.spin_dist) * self._turned_angle
        if remaining <= SPIN_TOLERANCE_RAD or self._robot.turning_radius > 0.0:
            return None
        if seconds > self._spec.time_allowance:
            raise NavigationFailure(ErrorCode.SPIN_TIMEOUT, "spinning took too long")
        stopping_rate = math.sqrt(2.0 * self._deceleration * remaining)
        max_rate = min(self._spec.max_rotational_vel, self._robot.max_angular)
        turn_rate = min(max(stopping_rate, self._spec.min_rotational_vel), max_rate)
        command = Twist(0.0, 0.0, math.copysign(turn_rate, self._spec.spin_dist))
        horizon = min(self._spec.simulate_ahead_time, remaining / abs(command.wz))
        if time_to_collision(self._footprint, costmap, pose, command, horizon) < horizon:
            raise NavigationFailure(ErrorCode.SPIN_COLLISION_AHEAD, "no room to spin")
        return command


class BackUp:
    """Recovery behavior that drives straight back by `backup_dist` m.

    The behavior fails if it predicts a collision within `simulate_ahead_time`. With `backup_partial`, the robot stops
    before the obstacle instead, and the behavior fails only if the robot cannot move by one costmap cell.
    """

    name = "backup"

    def __init__(self, spec: model.BackUp, setting: Setting) -> None:
        self._spec, self._robot, self._footprint = spec, setting.robot, setting.footprint
        self._start_pose = Pose2(0.0, 0.0)

    def start(self, pose: Pose2) -> None:
        """Start at this pose."""
        self._start_pose = pose

    def step(self, pose: Pose2, costmap: CostmapView, seconds: float) -> Twist | None:
        """Return the command `seconds` after the start; None when done.

        Raises NavigationFailure with BACKUP_COLLISION_AHEAD, BACKUP_TIMEOUT, or, if the robot cannot drive backward,
        BACKUP_INVALID_INPUT.
        """
        remaining = self._spec.backup_dist - self._start_pose.distance(pose)
        speed = min(self._spec.backup_speed, self._robot.max_reverse)
        if remaining <= 0.0:
            return None
        if speed <= 0.0:
            raise NavigationFailure(ErrorCode.BACKUP_INVALID_INPUT, "the robot cannot drive backward")
        if seconds > self._spec.time_allowance:
            raise NavigationFailure(ErrorCode.BACKUP_TIMEOUT, "backing up took too long")
        command = Twist(-speed, 0.0, 0.0)
        horizon = min(self._spec.simulate_ahead_time, remaining / speed)
        free_time = time_to_collision(self._footprint, costmap, pose, command, horizon)
        if free_time >= horizon or (self._spec.backup_partial and free_time * speed >= costmap.resolution):
            return command
        if self._spec.backup_partial and self._start_pose.distance(pose) >= costmap.resolution:
            return None
        raise NavigationFailure(ErrorCode.BACKUP_COLLISION_AHEAD, "no room behind")


class Wait:
    """Recovery behavior that stands still for `wait_duration` s, so that a moving obstacle can leave."""

    name = "wait"

    def __init__(self, spec: model.Wait, setting: Setting) -> None:
        self._duration = spec.wait_duration

    def start(self, pose: Pose2) -> None:
        """Do nothing."""

    def step(self, pose: Pose2, costmap: CostmapView, seconds: float) -> Twist | None:
        """Return the stop command; None when the time is over. `seconds` is the time since the start."""
        return STOP if seconds < self._duration else None


class ClearCostmap:
    """Recovery behavior that removes obstacles from the costmaps: around the robot, or all with `clear_entirely`.

    Obstacles in the latest sensor readings remain.
    """

    name = "clear_costmap"

    def __init__(self, spec: model.ClearCostmap, setting: Setting) -> None:
        self._clear = setting.clear_costmap if spec.clear_entirely else setting.clear_around

    def start(self, pose: Pose2) -> None:
        """Clear the costmaps."""
        self._clear()

    def step(self, pose: Pose2, costmap: CostmapView, seconds: float) -> Twist | None:
        """Return None: `start` has cleared the costmaps."""
        return None


PLANNER_CODES = frozenset(get_args(PlannerCode))
"""Names of the error codes of planners."""
MIN_PROGRESS_M = 1.0
"""With `retries_since_progress`, all retries are restored if the goal is this much closer than at all earlier
recoveries. The sequence then starts with the first behavior again."""


class BehaviorSequence:
    """Recovery behaviors in cyclic order (Nav2's RoundRobin). Each retry of a goal uses the next behavior."""

    def __init__(self, behaviors: Sequence[Behavior], spec: Recovery) -> None:
        """Take the behaviors in order, and the parameters `number_of_retries` per goal, `planner_codes`, and so on."""
        self._behaviors, self._max_retries = tuple(behaviors), spec.number_of_retries
        self._final_codes = PLANNER_CODES.difference(spec.planner_codes)
        self._resets_on_progress = spec.retries_since_progress
        self._next_index, self._used_retries, self._min_goal_distance = 0, 0, math.inf

    def can_help(self, failure: NavigationFailure) -> bool:
        """Return whether to try a recovery. False for an error of the planner whose code is not in `planner_codes`."""
        return getattr(failure.code, "name", "") not in self._final_codes

    def reset(self) -> None:
        """Restore all retries for a new goal. The cyclic order continues, as in Nav2."""
        self._used_retries, self._min_goal_distance = 0, math.inf

    def next_behavior(self, goal_distance: float) -> Behavior | None:
        """Return the next behavior, and count a retry; None if no retry is left. `goal_distance` is in m."""
        has_progress = goal_distance <= self._min_goal_distance - MIN_PROGRESS_M
        if self._resets_on_progress and has_progress and self._used_retries:
            self._used_retries = self._next_index = 0
        self._min_goal_distance = min(self._min_goal_distance, goal_distance)
        if not self._behaviors or self._used_retries >= self._max_retries:
            return None
        behavior = self._behaviors[self._next_index % len(self._behaviors)]
        self._next_index += 1
        self._used_retries += 1
        return behavior
