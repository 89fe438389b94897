"""Recovery behavior that drives back along the robot's own trail."""

import math
from collections.abc import Sequence
from itertools import product

import numpy as np

from simscen.advanced.spec import Retrace as RetraceSpec
from simscen.advanced.trail import Trail
from simscen.core.geometry import Array, Pose2
from simscen.core.geometry.kinematics import STOP, Twist
from simscen.core.messages.navigation import ErrorCode
from simscen.stack.footprint import distance_at, lethal_cells_near
from simscen.stack.kinematics import poses_along
from simscen.stack.moving_obstacles import Mask
from simscen.stack.protocols import CostmapView, NavigationFailure, RobotModel
from simscen.stack.setting import Setting

HORIZON_S = 1.0
"""Duration for which each candidate command is simulated."""
TIMES: Array = np.linspace(0.0, HORIZON_S, 11)
"""Times in s at which a candidate command is checked for collisions."""
MIN_FREE_STEPS = 3
"""If no command is free of collisions at all TIMES, a command must be free at this number of TIMES after 0."""
SLACK_CELLS = 0.3
"""Distance in cells by which the robot may come closer to an obstacle than it was on the trail."""
DEVIATION_WEIGHT = 2.0
"""Weight of the deviation from the trail relative to the progress along the trail."""
MIN_GAIN_M = 0.01
"""Minimum score of a command, in m above the score of standing still."""
WINDOW_M = 0.5
"""Length of the part of the trail, after the last position, that is searched for the robot's present position."""
SPEED_RATIOS = (-1.0, -0.5, 0.0, 0.5)
"""Candidate speeds relative to the maximum. The robot also drives forward, because a trail can have cusps."""
TURN_RATES_RAD_S = (0.0, 0.07, -0.07, 0.15, -0.15, 0.3, -0.3, 0.5, -0.5, 0.8, -0.8)
"""Candidate turn rates in rad/s."""
LATERAL_RATIOS = (0.0, 0.5, -0.5, 1.0, -1.0)
"""Candidate lateral speeds relative to the maximum, for a holonomic base that has strafed along its trail."""


class TrailFollower:
    """Makes the robot drive back along its trail, or straight backward where there is no trail.

    Each step simulates a few velocities on the local costmap. The best velocity has much progress along the trail and
    little deviation from it.
    """

    def __init__(self, setting: Setting, speed: float) -> None:
        """Take the setting of the behavior and the maximum speed in m/s."""
        self._footprint, self._recorded_trail, self._limit_command = (
            setting.footprint,
            setting.trail,
            setting.limit_command,
        )
        self.speed = min(speed, setting.robot.max_reverse)
        """Speed in m/s; 0 for a robot that cannot reverse."""
        self._last: Pose2 | None = None
        """Pose at the last call of `start` or `locate`."""
        self._commands = _candidate_commands(setting.robot, self.speed)

    def start(self, pose: Pose2, length: float) -> None:
        """Start at a pose in the odom frame. The straight part of the trail is `length` m long."""
        horizon = np.array([HORIZON_S])
        self._ends = np.stack([poses_along(Pose2(0.0, 0.0), each, horizon)[0] for each in (*self._commands, STOP)])
        """Poses (n, 3) in the base frame after HORIZON_S of each command and, last, of a stop."""
        radius, extension = self._footprint.circumscribed, length + self.speed * HORIZON_S
        self._trail, self._index = Trail(self._remaining_trail(), pose, radius, extension), 0
        self._last = pose

    def _remaining_trail(self) -> Sequence[Pose2]:
        """Return the recorded poses, without the part that the robot has already driven back."""
        poses = self._recorded_trail()
        if self._last is None or self._last not in poses:
            return poses
        first_new = len(poses) - poses[::-1].index(self._last)
        remaining = self._trail.poses[self._index : self._trail.known_count]
        return [*(Pose2(*each) for each in remaining[::-1].tolist()), *poses[first_new:]]

    def locate(self, pose: Pose2) -> None:
        """Find the robot on the trail: the pose nearest to `pose`, at most WINDOW_M after the last position."""
        window, self._last = self._window(), pose
        self._index += int(self._trail.footprint_distance(self._trail.poses[window], np.array(pose)).argmin())

    @property
    def driven(self) -> float:
        """Distance in m that the base has driven back."""
        return float(self._trail.base_distances[self._index])

    @property
    def footprint_moved(self) -> float:
        """Distance in m that the footprint has moved, by `Trail.footprint_distance`."""
        return float(self._trail.footprint_distances[self._index])

    def _window(self) -> slice:
        """Return the slice of the trail from the last position of the robot to WINDOW_M after it."""
        distances = self._trail.footprint_distances
        return slice(self._index, int(np.searchsorted(distances, distances[self._index] + WINDOW_M, side="right")))

    def command(self, pose: Pose2, costmap: CostmapView) -> Twist | None:
        """Return the best command without collisions in HORIZON_S, or else the best command without early collisions.

        None if no such command is better than standing still. If the collision monitor stops a command, other backward
        commands are tried, even if they are not better than standing still.
        """
        *scores, stop_score = self._scores(pose).tolist()
        has_strafed, is_vetoed = self._trail.has_strafed, False
        candidates = [k for k, each in enumerate(self._commands) if has_strafed or each.vy == 0.0]
        candidates.sort(key=lambda k: -scores[k])
        fallback: Twist | None = None
        for k in candidates:
            command, is_better = self._commands[k], scores[k] > stop_score + MIN_GAIN_M
            if not is_better and (fallback is not None or not is_vetoed):
                break
            if is_vetoed and (command.vx > 0.0 or (command.vx == 0.0 and not is_better)):
                continue
            blocked = self._blocked(pose, poses_along(pose, command, TIMES), costmap)
            if blocked.any() and (not is_better or fallback is not None or blocked.argmax() <= MIN_FREE_STEPS):
                continue
            if self._limit_command(command, pose) == STOP:
                is_vetoed = True
            elif blocked.any():
                fallback = command
            else:
                return command
        return fallback

    def _blocked(self, pose: Pose2, poses: Array, costmap: CostmapView) -> Mask:
        """Return which of the poses (n, 3) collide with obstacle cells.

        An obstacle cell is ignored if the robot is about as near to the cell now, or was on its trail. Such a cell is
        an error of the costmap.
        """
        blocked: Mask = ~self._footprint.free(costmap, poses)
        if not blocked.any():
            return blocked
        cell_size = costmap.resolution
        reach = self._footprint.circumscribed + self.speed * HORIZON_S + cell_size
        cells = lethal_cells_near(costmap, pose.x, pose.y, reach)
        known_poses = self._trail.poses[self._window()][: max(0, self._trail.known_count - self._index)]
        on_trail = self._footprint.point_distances(cells, known_poses).min(axis=0, initial=cell_size)
        current = self._footprint.point_distances(cells, np.array([pose]))[0]
        limits = np.minimum(np.where(on_trail < -cell_size, cell_size, on_trail), np.maximum(current, -cell_size / 2))
        is_nearer = self._footprint.point_distances(cells, poses) < np.minimum(
            limits - SLACK_CELLS * cell_size, cell_size / math.sqrt(2.0)
        )
        return np.asarray(blocked & is_nearer.any(axis=1))

    def _scores(self, pose: Pose2) -> Array:
        """Return the scores (n,) in m of all commands and, last, of a stop: progress minus weighted deviation."""
        cosine, sine = math.cos(pose.yaw), math.sin(pose.yaw)
        ends = np.column_stack((
            pose.x + cosine * self._ends[:, 0] - sine * self._ends[:, 1],
            pose.y + sine * self._ends[:, 0] + cosine * self._ends[:, 1],
            pose.yaw + self._ends[:, 2],
        ))  # fmt: skip
        window = self._window()
        deviation = self._trail.footprint_distance(ends[:, None], self._trail.poses[None, window])
        scores: Array = (self._trail.footprint_distances[window] - DEVIATION_WEIGHT * deviation).max(axis=1)
        return scores


def _candidate_commands(robot: RobotModel, speed: float) -> list[Twist]:
    """Return the combinations of candidate velocities that the robot can drive."""
    commands = list[Twist]()
    for speed_ratio, lateral_ratio, rate in product(
        SPEED_RATIOS, LATERAL_RATIOS if robot.max_lateral > 0.0 else (0.0,), TURN_RATES_RAD_S
    ):
        max_rate = robot.max_angular
        if robot.turning_radius > 0.0:
            max_rate = min(max_rate, abs(speed_ratio) * speed / robot.turning_radius)
        turn = max(-max_rate, min(rate, max_rate))
        commands.append(Twist(speed_ratio * speed, lateral_ratio * min(speed, robot.max_lateral), turn))
    return [each for each in dict.fromkeys(commands) if each != STOP]


TIME_ALLOWANCE_RATIO = 1.5
"""Minimum time limit of the behavior, relative to the time that `retrace_dist` takes at the maximum speed."""


class Retrace:
    """Recovery behavior that drives back along the trail until there is room to turn in place, or to `retrace_dist`."""

    name = "retrace"

    def __init__(self, spec: RetraceSpec, setting: Setting) -> None:
        self._spec, self._footprint = spec, setting.footprint
        self._follower = TrailFollower(setting, spec.backup_speed)

    def start(self, pose: Pose2) -> None:
        """Start the behavior at this pose."""
        self._follower.start(pose, max(self._spec.backup_dist, self._spec.retrace_dist))

    def step(self, pose: Pose2, costmap: CostmapView, seconds: float) -> Twist | None:
        """Return the command, `seconds` after the start; None if the robot has driven back far enough or cannot go on.

        Raises NavigationFailure: BACKUP_INVALID_INPUT if the robot cannot reverse, BACKUP_TIMEOUT, or
        BACKUP_COLLISION_AHEAD if the robot could not move by a single cell.
        """
        follower = self._follower
        if follower.speed <= 0.0:
            raise NavigationFailure(ErrorCode.BACKUP_INVALID_INPUT, "the robot cannot drive backward")
        follower.locate(pose)
        if follower.driven >= self._spec.retrace_dist:
            return None
        if follower.driven >= self._spec.backup_dist and self._can_turn(pose, costmap):
            return None
        if seconds > max(self._spec.time_allowance, TIME_ALLOWANCE_RATIO * self._spec.retrace_dist / follower.speed):
            raise NavigationFailure(ErrorCode.BACKUP_TIMEOUT, "driving back along the trail took too long")
        command = follower.command(pose, costmap)
        if command is None and follower.footprint_moved < costmap.resolution:
            raise NavigationFailure(ErrorCode.BACKUP_COLLISION_AHEAD, "the trail is blocked")
        return command

    def _can_turn(self, pose: Pose2, costmap: CostmapView) -> bool:
        """Return whether there is room to turn in place at a pose."""
        return distance_at(costmap, pose.x, pose.y) > self._footprint.circumscribed + costmap.resolution
