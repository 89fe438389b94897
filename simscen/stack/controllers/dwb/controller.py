"""DWB: a dynamic-window controller (Fox, Burgard and Thrun 1997) with the critics of nav2_dwb_controller."""

import numpy as np

from simscen.core.geometry import Array, Pose2
from simscen.core.geometry.kinematics import STOP, Twist
from simscen.core.messages.goals import Goal
from simscen.core.messages.navigation import ErrorCode, Path
from simscen.model.controllers import DynamicWindow as DwbSpec
from simscen.stack.controllers.dwb.critics import (
    ObstacleCritic,
    OscillationCritic,
    RotateToGoalCritic,
    score_trajectories,
)
from simscen.stack.controllers.dwb.trajectory_generator import (
    generate_trajectories,
    kinematic_parameters,
    velocity_window,
)
from simscen.stack.controllers.goal_rotation import GoalRotation
from simscen.stack.controllers.path_follower import PathFollower
from simscen.stack.controllers.path_handler import upcoming_path
from simscen.stack.protocols import CostmapView, NavigationFailure
from simscen.stack.setting import Setting

PLAN_LENGTH_RATIO, PLAN_MARGIN_M = 1.2, 0.5
"""Minimum length of the plan for critics: 1.2 times the distance that the robot drives in `sim_time`, plus 0.5 m."""


class DynamicWindowController(PathFollower):
    """Samples velocities that can be reached within `sim_time`, and commands the velocity with the best score."""

    def __init__(self, spec: DwbSpec, setting: Setting) -> None:
        robot = setting.robot
        super().__init__(spec, spec.max_vel_x, robot)
        self._spec, self._robot = spec, robot
        self._kinematics = kinematic_parameters(spec, robot, self._full_speed)
        self._sample_counts = (spec.vx_samples, spec.vy_samples, spec.vtheta_samples)
        self._goal_rotation = GoalRotation(
            robot, spec.max_vel_theta, robot.angular_acceleration, setting.control_period, spec.goal_tolerance_ratio
        )
        self._obstacle_critic = ObstacleCritic(setting.footprint, spec.preferred_clearance)
        self._rotate_to_goal = RotateToGoalCritic(spec.trans_stopped_velocity, spec.slowing_factor)
        self._oscillation = OscillationCritic(
            spec.oscillation_reset_dist, spec.oscillation_reset_angle, spec.x_only_threshold
        )
        self._best_trajectory: Array | None = None

    def reset_for_goal(self) -> None:
        """Reset goal rotation and critics for another goal."""
        self._goal_rotation.reset()
        self._rotate_to_goal.reset()
        self._oscillation.reset()

    @property
    def local_plan(self) -> Path | None:
        """The trajectory with the best score; None before the first command."""
        return None if self._best_trajectory is None else Path(self._best_trajectory)

    def command(self, pose: Pose2, twist: Twist, costmap: CostmapView, goal: Goal) -> Twist:
        """Return the velocity command. Raises NO_VALID_CONTROL if no sampled trajectory is legal."""
        tracker = self._locate(pose)
        is_reached = self._goal_rotation.is_position_reached(pose, twist, goal, tracker.remaining())
        if is_reached and self._robot.turning_radius > 0.0:
            return STOP
        spec, kinematics = self._spec, self._kinematics.scaled(self._speed_ratio)
        velocities = velocity_window(kinematics, twist, spec.sim_time, self._sample_counts)
        if not len(velocities):
            raise NavigationFailure(ErrorCode.NO_VALID_CONTROL, "no velocity is within the limits")
        trajectories = generate_trajectories(
            pose, twist, velocities, kinematics, spec.sim_time, spec.linear_granularity, spec.angular_granularity
        )
        ends = trajectories.ends
        driven_distance = (abs(twist.vx) + abs(twist.vy)) * spec.sim_time
        plan_length = max(spec.prune_distance, PLAN_LENGTH_RATIO * driven_distance + PLAN_MARGIN_M)
        plan = upcoming_path(tracker, plan_length, costmap.resolution).points[:, :2]
        scores = score_trajectories(spec, costmap, pose, goal.pose, plan, velocities, ends)
        is_legal, total = self._oscillation.is_legal(velocities), scores.total
        if is_reached and spec.rotate_to_goal_scale > 0.0:
            rotation, may_rotate = self._rotate_to_goal.scores(twist, goal.pose.yaw, velocities, ends[:, 2])
            is_legal, total = is_legal & may_rotate, total + spec.rotate_to_goal_scale * rotation
        order = np.argsort(np.where(is_legal, total, np.inf), kind="stable")
        order = order[: int(np.count_nonzero(is_legal & np.isfinite(total)))]
        best = self._obstacle_critic.first_free(costmap, pose, trajectories, order)
        command = STOP if best is None else Twist(*velocities[best].tolist())
        self._oscillation.record(pose, command)
        if best is None:
            raise NavigationFailure(ErrorCode.NO_VALID_CONTROL, "no trajectory is legal")
        self._best_trajectory = trajectories.poses(np.array([best]))[:, 0]
        return command
