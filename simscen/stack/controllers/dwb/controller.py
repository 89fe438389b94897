"""A dynamic-window controller (Fox, Burgard and Thrun 1997) with the critics of nav2_dwb_controller."""

import numpy as np

from simscen.core.geometry import Array, Pose2
from simscen.core.geometry.kinematics import STOP, Twist
from simscen.core.messages.navigation import ErrorCode, Goal, Path
from simscen.model.controllers import DynamicWindow as DwbSpec
from simscen.stack.controllers.dwb.critics import RotateToGoalCritic, score_trajectories
from simscen.stack.controllers.dwb.obstacle_critic import ObstacleCritic
from simscen.stack.controllers.dwb.oscillation_critic import OscillationCritic
from simscen.stack.controllers.dwb.trajectory_generator import generate_trajectories, kinematics_of, velocity_window
from simscen.stack.controllers.goal_rotation import GoalRotation
from simscen.stack.controllers.path_follower import PathFollower
from simscen.stack.controllers.path_handler import local_plan
from simscen.stack.protocols import CostmapView, NavigationFailure
from simscen.stack.setting import Setting

PLAN_REACH_RATIO, PLAN_MARGIN_M = 1.2, 0.5
"""The plan is looked at so much further than the robot gets in `sim_time` as it drives now, and meters more: what ends
nearer holds it back, and from what lies beyond a bend of the plan the straight way leads into a wall."""


class DynamicWindowController(PathFollower):
    """Tries the velocities that can be reached within `sim_time` and takes the one the critics like best."""

    def __init__(self, spec: DwbSpec, setting: Setting) -> None:
        robot = setting.robot
        super().__init__(spec.max_vel_x, robot)
        self._spec, self._robot = spec, robot
        self._base = kinematics_of(spec, robot, self._fastest)
        self._samples = (spec.vx_samples, spec.vy_samples, spec.vtheta_samples)
        self._goal_pose = GoalRotation(robot, spec.max_vel_theta, robot.angular_acceleration, setting.control_period)
        self._room = ObstacleCritic(setting.footprint)
        self._rotate = RotateToGoalCritic(spec.trans_stopped_velocity, spec.slowing_factor)
        self._oscillation = OscillationCritic(
            spec.oscillation_reset_dist, spec.oscillation_reset_angle, spec.x_only_threshold
        )
        self._best: Array | None = None

    def begin(self) -> None:
        """Another goal: what was learned on the way to the last one does not count."""
        self._goal_pose.reset()
        self._rotate.reset()
        self._oscillation.reset()

    @property
    def local_plan(self) -> Path | None:
        """The trajectory that was liked best."""
        return None if self._best is None else Path(self._best)

    def command(self, pose: Pose2, twist: Twist, costmap: CostmapView, goal: Goal) -> Twist:
        """Return the velocity to drive now. Raises NO_VALID_CONTROL when every trajectory is in collision."""
        track = self._located(pose)
        there = self._goal_pose.reached(pose, twist, goal, track.remaining())
        if there and self._robot.turning_radius > 0.0:
            return STOP
        spec, kinematics = self._spec, self._base.scaled(self._share)
        velocities = velocity_window(kinematics, twist, spec.sim_time, self._samples)
        if not len(velocities):
            raise NavigationFailure(ErrorCode.NO_VALID_CONTROL, "the limits leave no velocity")
        tried = generate_trajectories(
            pose, twist, velocities, kinematics, spec.sim_time, spec.linear_granularity, spec.angular_granularity
        )
        ends = tried.ends
        driven = (abs(twist.vx) + abs(twist.vy)) * spec.sim_time
        reach = max(spec.prune_distance, PLAN_REACH_RATIO * driven + PLAN_MARGIN_M)
        plan = local_plan(track, reach, costmap.resolution).points[:, :2]
        found = score_trajectories(spec, costmap, pose, goal.pose, plan, velocities, ends)
        legal, total = self._oscillation.legal(velocities), found.total
        if there and spec.rotate_to_goal_scale > 0.0:
            off, allowed = self._rotate.scores(twist, goal.pose.yaw, velocities, ends[:, 2])
            legal, total = legal & allowed, total + spec.rotate_to_goal_scale * off
        order = np.argsort(np.where(legal, total, np.inf), kind="stable")
        order = order[: int(np.count_nonzero(legal & np.isfinite(total)))]
        best = self._room.first_free(costmap, pose, tried, order)
        command = STOP if best is None else Twist(*velocities[best].tolist())
        self._oscillation.debrief(pose, command)
        if best is None:
            raise NavigationFailure(ErrorCode.NO_VALID_CONTROL, "no trajectory is legal")
        self._best = tried.poses(np.array([best]))[:, 0]
        return command
