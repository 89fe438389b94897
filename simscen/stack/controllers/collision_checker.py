"""Collision checks of velocity commands and rotations, for all controllers."""

import math

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose2
from simscen.core.geometry.kinematics import STOP, Twist
from simscen.core.messages.navigation import ErrorCode
from simscen.stack.footprint import Footprint, distance_at, distances, lethal_cells_near
from simscen.stack.kinematics import MIN_YAW_RATE_RAD_S, poses_along
from simscen.stack.moving_obstacles import MAX_INFLATION_M
from simscen.stack.protocols import CostmapView, NavigationFailure

SPEED_FACTORS = (1.0, 0.75, 0.5, 0.25, 0.0)
"""Factors for a command that would hit a moving obstacle, in the order in which they are tried."""
MAX_TIME_STEP_S = 0.1
"""Maximum time between two poses that are checked for collisions with moving obstacles."""
UNCERTAINTY_SIGMAS = 0.5
"""Moving obstacles are inflated by this number of standard deviations of their position."""
APPROACH_TOLERANCE_M = 1e-4
"""Decrease of the distance to a moving obstacle that counts as an approach. Contact without approach is ignored."""


class CollisionChecker:
    """Checks the arc of a command for collisions, and slows the command down if a collision is near."""

    def __init__(self, footprint: Footprint, min_speed: float) -> None:
        """Take the footprint, and the minimum speed in m/s of a command after slowing down."""
        self._footprint, self._min_speed = footprint, min_speed

    def free_time(self, costmap: CostmapView, pose: Pose2, command: Twist, horizon: float) -> float:
        """Return the time in s, at most `horizon`, until the command leads to a collision with a static obstacle."""
        return horizon if command == STOP else time_to_collision(self._footprint, costmap, pose, command, horizon)

    def slow_down(self, command: Twist, free_time: float, horizon: float, full_speed_time: float) -> Twist:
        """Return the command, scaled by `free_time / full_speed_time` if `free_time` is below `horizon`.

        All times are in s. Raises NO_VALID_CONTROL if the scaled command is slower than the minimum speed.
        """
        if free_time >= horizon:
            return command
        scale = free_time / full_speed_time
        if max(abs(command.vx), abs(command.vy)) * scale < self._min_speed:
            raise NavigationFailure(ErrorCode.NO_VALID_CONTROL, f"collision ahead in {free_time:.2f} s")
        return Twist(command.vx * scale, command.vy * scale, command.wz * scale)

    def slow_down_for_moving(self, command: Twist, costmap: CostmapView, pose: Pose2, horizon: float) -> Twist:
        """Return the command, multiplied by the largest of SPEED_FACTORS that avoids moving obstacles for `horizon` s.

        If no factor avoids all obstacles, use the factor with the latest collision.
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
"""Minimum distance in cells between the footprint and the center of a lethal cell during a rotation in place."""
BACKUP_SPEED_M_S, BACKUP_FREE_TIME_S = 0.15, 1.0
"""Speed of backing up (Nav2's backup_speed), and time for which this command must be free of collisions."""
BACKUP_TURN_RATES_RAD_S = (0.0, 0.3, -0.3, 0.6, -0.6)
"""Turn rates of backing up, in the order of attempts."""


class RotationClearance:
    """Checks whether a robot has room to rotate in place, and finds a command to back up if there is no room."""

    def __init__(self, footprint: Footprint, max_reverse: float) -> None:
        """Take the footprint, and the maximum speed in m/s of driving backward."""
        self._footprint, self._backup_speed = footprint, min(BACKUP_SPEED_M_S, max_reverse)

    def has_room(self, angle: float, pose: Pose2, costmap: CostmapView) -> bool:
        """Return whether a rotation by `angle` rad keeps the required clearance; the current clearance if smaller."""
        radius = self._footprint.rotation_radius
        if radius == 0.0 or distance_at(costmap, pose.x, pose.y) > radius + 2.0 * costmap.resolution:
            return True
        steps = max(2, math.ceil(abs(angle) * radius / costmap.resolution) + 1)
        poses = poses_along(pose, Twist(0.0, 0.0, angle), np.linspace(0.0, 1.0, steps))
        clearance = self._footprint.clearance(costmap, poses)
        required = min(ROTATION_CLEARANCE_CELLS * costmap.resolution, float(clearance[0]))
        return bool((clearance >= required).all())

    def backup_command(self, pose: Pose2, costmap: CostmapView) -> Twist | None:
        """Return the command to back up with the first collision-free turn rate; None if all turn rates collide."""
        for turn_rate in BACKUP_TURN_RATES_RAD_S if self._backup_speed > 0.0 else ():
            command = Twist(-self._backup_speed, 0.0, turn_rate)
            if time_to_collision(self._footprint, costmap, pose, command, BACKUP_FREE_TIME_S) >= BACKUP_FREE_TIME_S:
                return command
        return None


CELL_DIAGONAL_CELLS = 1.4143
"""Diagonal of a cell in cells (square root of 2), rounded up."""


def time_to_collision(footprint: Footprint, costmap: CostmapView, pose: Pose2, twist: Twist, horizon: float) -> float:
    """Return the time in s until the first collision with a static obstacle at this velocity, at most `horizon`.

    If the robot already is in collision, only motion into another obstacle, or more than half a cell deeper into the
    same obstacle, counts as a collision. The robot can therefore drive away from the obstacle.
    """
    if _is_surely_free(footprint.circumscribed, costmap, pose, twist, horizon):
        return horizon
    speed = math.hypot(twist.vx, twist.vy) + abs(twist.wz) * footprint.rotation_radius
    steps = max(2, math.ceil(horizon * speed / costmap.resolution) + 1)
    times = np.linspace(0.0, horizon, steps)
    poses = poses_along(pose, twist, times)
    blocked = ~footprint.free(costmap, poses)
    if blocked[0]:
        blocked = _is_deeper(footprint, costmap, poses)
    if not blocked.any():
        return horizon
    return float(times[max(0, int(blocked.argmax()) - 1)])


def _is_deeper(footprint: Footprint, costmap: CostmapView, poses: Array) -> npt.NDArray[np.bool_]:
    """Return which of the poses (n, 3) are deeper in an obstacle than the first pose, or in another obstacle."""
    reach = footprint.circumscribed + float(np.hypot(*(poses[:, :2] - poses[0, :2]).T).max()) + costmap.resolution
    gaps = footprint.point_distances(lethal_cells_near(costmap, poses[0, 0].item(), poses[0, 1].item(), reach), poses)
    is_deeper = gaps < np.minimum(gaps[0] - 0.5 * costmap.resolution, 0.0)
    is_lethal = distances(costmap, poses[:, :2]) <= 0.0
    return np.asarray(is_deeper.any(axis=1) | (is_lethal & ~is_lethal[0]))


def _is_surely_free(radius: float, costmap: CostmapView, pose: Pose2, twist: Twist, horizon: float) -> bool:
    """Return True if a disc of `radius` m is certainly free along the arc; False if uncertain.

    Quick check by sphere tracing: each step along the arc is as long as the free distance.
    """
    vx, vy, wz = twist
    speed, is_turning = math.hypot(vx, vy), abs(wz) >= MIN_YAW_RATE_RAD_S
    cosine, sine, resolution = math.cos(pose.yaw), math.sin(pose.yaw), costmap.resolution
    required = radius + CELL_DIAGONAL_CELLS * resolution  # because `costmap.distance` is between cell centers
    time, disc_x, disc_y = 0.0, pose.x, pose.y
    while True:
        free_distance = distance_at(costmap, disc_x, disc_y) - required
        if free_distance <= resolution and (free_distance <= 0.0 or speed > 0.0):
            return False
        if time >= horizon or speed == 0.0:
            return True
        time += free_distance / speed
        time = min(time, horizon)
        forward, left = (math.sin(wz * time) / wz, (1.0 - math.cos(wz * time)) / wz) if is_turning else (time, 0.0)
        x, y = vx * forward - vy * left, vx * left + vy * forward
        disc_x, disc_y = pose.x + cosine * x - sine * y, pose.y + sine * x + cosine * y
