"""A dynamic-window controller (Fox, Burgard and Thrun 1997) with the critics of nav2_dwb_controller."""

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose2
from simscen.core.motion import STOP, Twist
from simscen.core.navigation import ErrorCode, Goal, Path
from simscen.model.controllers import DynamicWindow as DwbSpec
from simscen.stack.controllers.dwb.critics import scores
from simscen.stack.controllers.dwb.kinematics import kinematics_of, window
from simscen.stack.controllers.dwb.oscillation import Oscillation
from simscen.stack.controllers.dwb.rotate_to_goal import RotateToGoal
from simscen.stack.controllers.dwb.trajectories import trajectories
from simscen.stack.controllers.following import PathFollower
from simscen.stack.controllers.goal_pose import GoalPose
from simscen.stack.controllers.local_plan import local_plan
from simscen.stack.protocols import CostmapView, NavigationFailure
from simscen.stack.setting import Setting

Mask = npt.NDArray[np.bool_]
ROOM = 0.05
"""Metres that trajectories keep off obstacles where any can."""
FURTHER, BEYOND = 1.2, 0.5
"""The plan is looked at so much further than the robot gets in `sim_time` as it drives now, and metres more: what ends
nearer holds it back, and from what lies beyond a bend of the plan the straight way leads into a wall."""


class DynamicWindowController(PathFollower):
    """Tries the velocities that can be reached within `sim_time` and takes the one the critics like best."""

    def __init__(self, spec: DwbSpec, setting: Setting) -> None:
        robot = setting.robot
        super().__init__(spec.max_vel_x, robot)
        self._spec, self._robot, self._footprint = spec, robot, setting.footprint
        self._base = kinematics_of(spec, robot, self._fastest)
        self._samples = (spec.vx_samples, spec.vy_samples, spec.vtheta_samples)
        self._goal_pose = GoalPose(robot, spec.max_vel_theta, robot.angular_acceleration, setting.control_period)
        self._rotate = RotateToGoal(spec.trans_stopped_velocity, spec.slowing_factor)
        self._oscillation = Oscillation(
            spec.oscillation_reset_dist, spec.oscillation_reset_angle, spec.x_only_threshold
        )
        self._best: Array | None = None

    def begin(self) -> None:
        """Another goal: what was learnt on the way to the last one does not count."""
        self._goal_pose.reset()
        self._rotate.reset()
        self._oscillation.reset()

    @property
    def local_plan(self) -> Path | None:
        """The trajectory that was liked best."""
        return None if self._best is None else Path(self._best)

    def command(self, pose: Pose2, twist: Twist, costmap: CostmapView, goal: Goal) -> Twist:
        """The velocity to drive now. Raises NO_VALID_CONTROL when every trajectory hits something."""
        track = self._located(pose)
        there = self._goal_pose.reached(pose, twist, goal, track.remaining())
        if there and self._robot.turning_radius > 0.0:
            return STOP
        spec, kinematics = self._spec, self._base.scaled(self._share)
        velocities = window(kinematics, twist, spec.sim_time, self._samples)
        poses = trajectories(
            pose, twist, velocities, kinematics, spec.sim_time, spec.linear_granularity, spec.angular_granularity
        )
        driven = (abs(twist.vx) + abs(twist.vy)) * spec.sim_time
        reach = max(spec.prune_distance, FURTHER * driven + BEYOND)
        plan = local_plan(track, reach, costmap.resolution).points[:, :2]
        found = scores(spec, costmap, pose, goal.pose, plan, velocities, poses[:, -1])
        legal, total = self._oscillation.legal(velocities), found.total
        if there and spec.rotate_to_goal_scale > 0.0:
            off, allowed = self._rotate.scores(twist, goal.pose.yaw, velocities, poses[:, -1, 2])
            legal, total = legal & allowed, total + spec.rotate_to_goal_scale * off
        legal &= np.isfinite(total)
        legal[legal] = self._free(costmap, pose, poses[legal])
        return self._chosen(pose, velocities, poses, np.where(legal, total, np.inf))

    def _chosen(self, pose: Pose2, velocities: Array, poses: Array, total: Array) -> Twist:
        best = int(np.argmin(total)) if len(total) else 0
        command = Twist(*velocities[best].tolist()) if len(total) and np.isfinite(total[best]) else STOP
        self._oscillation.debrief(pose, command)
        if command == STOP:
            raise NavigationFailure(ErrorCode.NO_VALID_CONTROL, "no trajectory is legal")
        self._best = poses[best]
        return command

    def _free(self, costmap: CostmapView, pose: Pose2, poses: Array) -> Mask:
        """Which trajectories (n, steps, 3) hit nothing; from a collision those that lead out of it."""
        if not len(poses):
            return np.zeros(0, dtype=bool)
        gap = self._footprint.discs.clearance(costmap, poses[..., 0], poses[..., 1], poses[..., 2])
        for room in (ROOM, 0.0):
            roomy: Mask = np.asarray((gap > room).all(axis=1))
            if roomy.any():
                return roomy
        count, steps = poses.shape[:2]
        exact = self._footprint.free(costmap, poses.reshape(-1, 3)).reshape(count, steps)
        free: Mask = np.asarray(exact.all(axis=1))
        if free.any() or self._footprint.clearance(costmap, np.array([pose]))[0] > 0:
            return free
        return np.asarray((gap[:, -1] > gap[:, 0] + 0.5 * costmap.resolution) & (gap.min(axis=1) >= gap[:, 0]))
