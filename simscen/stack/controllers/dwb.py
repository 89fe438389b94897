"""A dynamic-window controller (Fox, Burgard and Thrun 1997) with the critics of nav2_dwb_controller."""

import math

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose2
from simscen.core.motion import Twist
from simscen.core.navigation import ErrorCode, Goal, Path
from simscen.model.controllers import DynamicWindow as DwbSpec
from simscen.stack.controllers.goal_pose import GoalPose
from simscen.stack.controllers.tracking import PathTracker
from simscen.stack.protocols import CostmapView, NavigationFailure
from simscen.stack.setting import Setting

STEP = 0.1
"""Seconds between two poses of a trajectory."""
ROOM = 0.05
"""Metres that trajectories keep off obstacles where any can."""
WINDOW = 1.5
"""Metres of path ahead that critics see: half of Nav2's local costmap."""
TURN = 1.0
"""rad/s at most while turning to the goal's heading."""


class DynamicWindowController:
    """Tries the velocities that can be reached within `sim_time` and takes the one the critics like best."""

    def __init__(self, spec: DwbSpec, setting: Setting) -> None:
        robot = setting.robot
        self._spec, self._robot, self._footprint = spec, robot, setting.footprint
        self._fastest = min(spec.max_vel_x or robot.max_linear, robot.max_linear)
        self._times = np.arange(1, round(spec.sim_time / STEP) + 1) * STEP
        self._goal_pose = GoalPose(robot, TURN, robot.angular_acceleration, setting.control_period)
        self._limit = math.inf
        self._track: PathTracker | None = None
        self._best: Array | None = None
        self._turned = 0.0

    def set_path(self, path: Path) -> None:
        """Follow this path from now on."""
        if not len(path.points):
            raise NavigationFailure(ErrorCode.INVALID_PATH, "the path has no points")
        self._track = PathTracker(path)
        self._goal_pose.reset()

    @property
    def full_speed(self) -> float:
        """What it drives at in m/s where nothing limits it."""
        return self._fastest

    def set_speed_limit(self, limit: float | None) -> None:
        """Drive no faster than this in m/s; None lifts the limit."""
        self._limit = math.inf if limit is None else limit

    @property
    def local_plan(self) -> Path | None:
        """The trajectory that was liked best."""
        return None if self._best is None else Path(self._best)

    def command(self, pose: Pose2, twist: Twist, costmap: CostmapView, goal: Goal) -> Twist:
        """The velocity to drive now. Raises NO_VALID_CONTROL when every trajectory hits something."""
        if self._track is None:
            raise NavigationFailure(ErrorCode.INVALID_PATH, "there is no path to follow")
        self._track.locate(pose)
        if self._goal_pose.reached(pose, twist, goal, self._track.remaining()):
            return self._turn(pose, twist, costmap, goal)
        velocities = self._window(twist)
        poses = self._trajectories(pose, twist, velocities)
        legal = self._legal(costmap, pose, poses)
        if not legal.any():
            raise NavigationFailure(ErrorCode.NO_VALID_CONTROL, "every trajectory hits something")
        cost = np.where(legal, self._criticise(costmap, poses, velocities), np.inf)
        best = int(np.argmin(cost))
        self._best = poses[best]
        self._turned = float(velocities[best, 1])
        return Twist(float(velocities[best, 0]), 0.0, float(velocities[best, 1]))

    def _turn(self, pose: Pose2, twist: Twist, costmap: CostmapView, goal: Goal) -> Twist:
        command = self._goal_pose.turn_to_goal(pose, goal, twist)
        poses = self._trajectories(pose, command, np.array([[0.0, command.wz]]))
        if not self._legal(costmap, pose, poses).all():
            raise NavigationFailure(ErrorCode.NO_VALID_CONTROL, "no room to turn to the goal's heading")
        return command

    def _window(self, twist: Twist) -> Array:
        """Velocities (n, 2) that can be reached within sim_time; standing still is always one of them."""
        spec, robot, time = self._spec, self._robot, self._spec.sim_time
        fastest = min(self._fastest, self._limit)
        low = max(spec.min_vel_x, -robot.max_reverse, min(twist.vx - robot.linear_deceleration * time, fastest))
        high = max(low, min(fastest, twist.vx + robot.linear_acceleration * time))
        turn = min(spec.max_vel_theta, robot.max_angular)
        change = robot.angular_acceleration * time
        right, left = max(-turn, twist.wz - change), min(turn, twist.wz + change)
        forward = np.linspace(low, high, spec.vx_samples)
        around = np.append(np.linspace(right, left, spec.vtheta_samples), 0.0)
        grid = np.stack(np.meshgrid(forward, around, indexing="ij"), axis=-1).reshape(-1, 2)
        if robot.turning_radius > 0.0:
            grid = grid[np.abs(grid[:, 0]) >= np.abs(grid[:, 1]) * robot.turning_radius]
        return np.vstack((grid, (0.0, 0.0)))

    def _trajectories(self, pose: Pose2, twist: Twist, velocities: Array) -> Array:
        """Poses (n, steps, 3) when the base speeds up to each velocity as fast as it can and then keeps it."""
        robot, times = self._robot, self._times
        change = np.where(
            np.abs(velocities[:, 0]) < abs(twist.vx), robot.linear_deceleration, robot.linear_acceleration
        )
        vx = twist.vx + np.clip(velocities[:, :1] - twist.vx, -change[:, None] * times, change[:, None] * times)
        turn = robot.angular_acceleration * times
        wz = twist.wz + np.clip(velocities[:, 1:] - twist.wz, -turn, turn)
        yaw = pose.yaw + np.cumsum(wz, axis=1) * STEP
        middle = yaw - 0.5 * wz * STEP
        x = pose.x + np.cumsum(vx * np.cos(middle), axis=1) * STEP
        y = pose.y + np.cumsum(vx * np.sin(middle), axis=1) * STEP
        return np.stack((x, y, yaw), axis=-1)

    def _legal(self, costmap: CostmapView, pose: Pose2, poses: Array) -> npt.NDArray[np.bool_]:
        """BaseObstacle's veto: no pose in collision; from a collision only ways that lead out of it."""
        gap = self._footprint.discs.clearance(costmap, poses[..., 0], poses[..., 1], poses[..., 2])
        for room in (ROOM, 0.0):
            roomy: npt.NDArray[np.bool_] = np.asarray((gap > room).all(axis=1))
            if roomy[:-1].any():
                return roomy
        count, steps = poses.shape[:2]
        exact = self._footprint.free(costmap, poses.reshape(-1, 3)).reshape(count, steps)
        free: npt.NDArray[np.bool_] = np.asarray(exact.all(axis=1))
        if free.any() or self._footprint.clearance(costmap, np.array([pose]))[0] > 0:
            return free
        return np.asarray((gap[:, -1] > gap[:, 0] + 0.5 * costmap.resolution) & (gap.min(axis=1) >= gap[:, 0]))

    def _criticise(self, costmap: CostmapView, poses: Array, velocities: Array) -> Array:
        """The weighted sum of the critics (n,); Nav2's map-grid critics count half a scale a metre."""
        assert self._track is not None
        spec, track = self._spec, self._track
        end = max(2, int(np.searchsorted(track.along, track.along[track.index] + WINDOW)) - track.index)
        ahead = track.points[track.index : track.index + end, :2]
        last = poses[:, -1]
        nose = spec.forward_point_distance * np.column_stack((np.cos(last[:, 2]), np.sin(last[:, 2])))
        front = last[:, :2] + nose
        goal = ahead[-1]
        cost = 0.5 * spec.path_dist_scale * _distance_to(ahead, last[:, :2])
        cost += 0.5 * spec.path_align_scale * _distance_to(ahead, front)
        cost += 0.5 * spec.goal_dist_scale * np.hypot(last[:, 0] - goal[0], last[:, 1] - goal[1])
        cost += 0.5 * spec.goal_align_scale * np.hypot(front[:, 0] - goal[0], front[:, 1] - goal[1])
        cells = np.floor((last[:, :2] - np.array(costmap.origin)) / costmap.resolution).astype(np.int64)
        rows = np.clip(cells[:, 1], 0, costmap.costs.shape[0] - 1)
        columns = np.clip(cells[:, 0], 0, costmap.costs.shape[1] - 1)
        cost += spec.base_obstacle_scale * costmap.costs[rows, columns]
        swings = velocities[:, 1] * self._turned < 0.0
        return np.asarray(cost + np.where(swings, 0.1, 0.0))


def _distance_to(path: Array, points: Array) -> Array:
    """Distance (n,) from points (n, 2) to the nearest of the path's points (m, 2)."""
    dx = points[:, None, 0] - path[None, :, 0]
    dy = points[:, None, 1] - path[None, :, 1]
    return np.asarray(np.sqrt((dx * dx + dy * dy).min(axis=1)))
