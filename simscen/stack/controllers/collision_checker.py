"""Collision checks of velocity commands and rotations, shared by the controllers."""

import math

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose2
from simscen.core.geometry.kinematics import STOP, Twist
from simscen.core.messages.navigation import ErrorCode
from simscen.stack.footprint import Footprint, distance_at, distances, lethal_near
from simscen.stack.kinematics import MIN_YAW_RATE_RAD_S, poses_along
from simscen.stack.moving_obstacles import MAX_INFLATION_M
from simscen.stack.protocols import CostmapView, NavigationFailure

SPEED_FACTORS = (1.0, 0.75, 0.5, 0.25, 0.0)
"""Factors by which a command may be multiplied to let moving obstacles pass, in the order of the attempts."""
MAX_TIME_STEP_S, UNCERTAINTY_SIGMAS = 0.1, 0.5
"""Largest time between two checks of moving obstacles, and standard deviations by which these are enlarged."""
APPROACH_TOLERANCE_M = 1e-4
"""A robot that is already too close counts as approaching if its distance decreases by more than this."""


class CollisionChecker:
    """Checks the arc of a command for collisions, and slows the command down if a collision is near."""

    def __init__(self, footprint: Footprint, min_speed: float) -> None:
        """Take the footprint, and the lowest speed in m/s to which a command is slowed down."""
        self._footprint, self._min_speed = footprint, min_speed

    def free_time(self, costmap: CostmapView, pose: Pose2, command: Twist, horizon: float) -> float:
        """Return the time in s, at most `horizon`, for which the command does not hit a static obstacle."""
        return horizon if command == STOP else time_to_collision(self._footprint, costmap, pose, command, horizon)

    def slow_down(self, command: Twist, free_time: float, horizon: float, required: float) -> Twist:
        """Return the command; if it is not free for `horizon` s, slowed down so that it becomes free for `required` s.

        Raises NO_VALID_CONTROL if it would be slower than the minimum. Nav2 fails at once; slowing down first gives the
        planner time to find a way around the obstacle.
        """
        if free_time >= horizon:
            return command
        scale = free_time / required
        if max(abs(command.vx), abs(command.vy)) * scale < self._min_speed:
            raise NavigationFailure(ErrorCode.NO_VALID_CONTROL, f"collision ahead in {free_time:.2f} s")
        return Twist(command.vx * scale, command.vy * scale, command.wz * scale)

    def slow_down_for_moving(self, command: Twist, costmap: CostmapView, pose: Pose2, horizon: float) -> Twist:
        """Return the command times the largest of SPEED_FACTORS that avoids moving obstacles for `horizon` s.

        If none does, take the factor with the latest collision. Robot and obstacles are compared at the same times, so
        that the robot does not slow down for an obstacle that will have left. A stop is not a failure, because a moving
        obstacle will move on.
        """
        if not costmap.moving.obstacles or command == STOP:
            return command
        reach, speed = self._footprint.discs.reach + MAX_INFLATION_M, math.hypot(command.vx, command.vy)
        near = costmap.moving.near(pose.x, pose.y, reach, speed, horizon)
        if not near.obstacles:
            return command
        times = np.linspace(0.0, horizon, max(1, math.ceil(horizon / MAX_TIME_STEP_S)) + 1)
        collision_steps = list[int]()
        for factor in SPEED_FACTORS:
            gaps = self._footprint.gap(near, poses_along(pose, command, factor * times), times, UNCERTAINTY_SIGMAS)
            collides = (gaps[1:] < 0.0) & (gaps[1:] < gaps[0] - APPROACH_TOLERANCE_M)
            if not collides.any():
                break
            collision_steps.append(int(collides.argmax()))
        else:
            factor = SPEED_FACTORS[collision_steps.index(max(collision_steps))]
        return command if factor == 1.0 else Twist(factor * command.vx, factor * command.vy, factor * command.wz)


ROTATION_CLEARANCE_CELLS = 1.01
"""Minimum distance, in cells, between the footprint and the center of a lethal cell during a rotation in place. The
obstacle may be half a cell nearer, and a robot without a rear lidar does not see obstacles behind it."""
BACKUP_SPEED_M_S, BACKUP_FREE_TIME_S = 0.15, 1.0
"""Speed of backing up (Nav2's backup_speed), and time for which the command must be free of collisions."""
BACKUP_TURN_RATES_RAD_S = (0.0, 0.3, -0.3, 0.6, -0.6)
"""Turn rates to try in this order: a robot that entered on a curve may not be able to leave in a straight line."""


class RotationClearance:
    """Checks whether a robot with corners can rotate in place, and finds a way to back out if not.

    A robot that starts a rotation without room for all of it gets stuck: its corners come closer to obstacles with each
    step, until it can neither turn nor leave.
    """

    def __init__(self, footprint: Footprint) -> None:
        self._footprint = footprint

    def has_room(self, angle: float, pose: Pose2, costmap: CostmapView) -> bool:
        """Return whether a rotation by `angle` rad keeps the required clearance, or the current one if it is less."""
        reach = self._footprint.reach
        if reach == 0.0 or distance_at(costmap, pose.x, pose.y) > reach + 2.0 * costmap.resolution:
            return True
        steps = max(2, math.ceil(abs(angle) * reach / costmap.resolution) + 1)
        poses = poses_along(pose, Twist(0.0, 0.0, angle), np.linspace(0.0, 1.0, steps))
        clearance = self._footprint.clearance(costmap, poses)
        required = min(ROTATION_CLEARANCE_CELLS * costmap.resolution, float(clearance[0]))
        return bool((clearance >= required).all())

    def backup_command(self, pose: Pose2, costmap: CostmapView) -> Twist | None:
        """Return a command that backs up as straight as possible; None if every curvature is blocked."""
        for turn_rate in BACKUP_TURN_RATES_RAD_S:
            command = Twist(-BACKUP_SPEED_M_S, 0.0, turn_rate)
            if time_to_collision(self._footprint, costmap, pose, command, BACKUP_FREE_TIME_S) >= BACKUP_FREE_TIME_S:
                return command
        return None


CELL_DIAGONAL = 1.4143
"""Diagonal of a cell relative to its edge, rounded up."""


def time_to_collision(footprint: Footprint, costmap: CostmapView, pose: Pose2, twist: Twist, horizon: float) -> float:
    """Return the time in s until the first collision with a static obstacle at this velocity, at most `horizon`.

    A robot may already be in collision according to the costmap, for example because of a localization error. So that
    it can leave, only motion into another obstacle or more than half a cell deeper into the same one counts then.
    """
    if _is_surely_free(footprint.circumscribed, costmap, pose, twist, horizon):
        return horizon
    speed = math.hypot(twist.vx, twist.vy) + abs(twist.wz) * footprint.reach
    steps = max(2, math.ceil(horizon * speed / costmap.resolution) + 1)
    times = np.linspace(0.0, horizon, steps)
    poses = poses_along(pose, twist, times)
    blocked = ~footprint.free(costmap, poses)
    if blocked[0]:
        blocked = _is_worse(footprint, costmap, poses)
    if not blocked.any():
        return horizon
    return float(times[max(0, int(blocked.argmax()) - 1)])


def _is_worse(footprint: Footprint, costmap: CostmapView, poses: Array) -> npt.NDArray[np.bool_]:
    """Return which of the poses (n, 3) are deeper inside an obstacle than the first pose, or inside another one."""
    reach = footprint.circumscribed + float(np.hypot(*(poses[:, :2] - poses[0, :2]).T).max()) + costmap.resolution
    gaps = footprint.point_distances(lethal_near(costmap, poses[0, 0].item(), poses[0, 1].item(), reach), poses)
    deeper = gaps < np.minimum(gaps[0] - 0.5 * costmap.resolution, 0.0)
    in_lethal_cell = distances(costmap, poses[:, :2]) <= 0.0
    return np.asarray(deeper.any(axis=1) | (in_lethal_cell & ~in_lethal_cell[0]))


def _is_surely_free(radius: float, costmap: CostmapView, pose: Pose2, twist: Twist, horizon: float) -> bool:
    """Return True if a disc of `radius` m is certainly free along the arc: a quick check for open space.

    Each step is as long as the free distance. Half a cell diagonal is added at both of its ends, because distances are
    those between cell centers.
    """
    vx, vy, wz = twist
    speed, turns = math.hypot(vx, vy), abs(wz) >= MIN_YAW_RATE_RAD_S
    cosine, sine, resolution = math.cos(pose.yaw), math.sin(pose.yaw), costmap.resolution
    required = radius + CELL_DIAGONAL * resolution
    time, at_x, at_y = 0.0, pose.x, pose.y
    while True:
        free_distance = distance_at(costmap, at_x, at_y) - required
        if free_distance <= resolution and (free_distance <= 0.0 or speed > 0.0):
            return False
        if time >= horizon or speed == 0.0:
            return True
        time += free_distance / speed
        time = min(time, horizon)
        forward, left = (math.sin(wz * time) / wz, (1.0 - math.cos(wz * time)) / wz) if turns else (time, 0.0)
        x, y = vx * forward - vy * left, vx * left + vy * forward
        at_x, at_y = pose.x + cosine * x - sine * y, pose.y + sine * x + cosine * y
