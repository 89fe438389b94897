"""Avoidance of moving obstacles by trajectory rollouts.

While the controller's trajectory is safe, the controller's command is kept. Otherwise, a few hundred trajectories are
compared: the controller's trajectory at lower speeds, and sequences of two velocities. Their main cost is the risk of
coming too close to predicted obstacles. Among safe trajectories, progress decides.

Sources: Fox, Burgard, Thrun 1997; with moving obstacles, Seder and Petrović 2007.
"""

import math
from dataclasses import replace
from functools import cached_property

import numpy as np

from simscen.advanced.prediction.followed_path import FollowedPath
from simscen.advanced.prediction.rollouts import (
    HORIZON_S,
    MAX_TURN_RATE_RAD_S,
    TIMES,
    Rollouts,
    TrajectorySampler,
    arc_rollouts,
)
from simscen.core.geometry import Array, Pose2
from simscen.core.geometry.kinematics import STOP, Twist
from simscen.stack.footprint import CoveringDiscs
from simscen.stack.moving_obstacles import MAX_INFLATION_M, MovingObstacles, Reals
from simscen.stack.protocols import CostmapView, RobotModel

MIN_DISTANCE_M = 0.25
"""Distance to keep from moving obstacles, in addition to a standard deviation of their position."""
DECAY_TIME_S = 1.2
"""Time constant with which the weight of risk decays exponentially toward the future."""
RISK_DECAY: Array = np.exp(-TIMES / DECAY_TIME_S)
"""Weight of the risk at each of TIMES."""
APPROACH_WEIGHT, COLLISION_WEIGHT, MEAN_WEIGHT = 3.0, 10.0, 1.0
"""Weights of the maximum nearness to moving obstacles (1 at contact), of a collision, and of the mean nearness."""
STATIC_WEIGHT, STATIC_DISTANCE_M = 8.0, 0.08
"""Weight of a collision with a static obstacle, and the distance to keep from it."""
PROGRESS_WEIGHT, BACKWARD_WEIGHT, CHANGE_WEIGHT, DEVIATION_COST = 1.0, 0.15, 0.08, 0.1
"""Weights of progress, of driving backward, and of a changed command; cost of leaving the controller's trajectory."""
SAFE_RISK = 0.02
"""Maximum risk (`Avoidance._risk`) at which the controller's command is kept."""
RESUME_RISK = 0.01
"""Maximum risk at which the controller gets back control after avoidance; less than SAFE_RISK, as a hysteresis."""
SPEED_FRACTIONS = (1.0, 0.75, 0.5, 0.25, 0.0)
"""Fractions of the controller's speed that are tried on the controller's trajectory."""
BATCH_SIZE, ROUNDING_TOLERANCE = 64, 1e-9
"""Number of trajectories that are evaluated together, and the tolerance for rounding errors of costs."""
MIN_FULL_SPEED_M_S = 0.3
"""Lower limit of the full speed, to which sampled speeds and costs are relative."""
MAX_ROUND_DIFFERENCE_M = 0.15
"""A robot is treated as a disc if its circumscribed and inscribed radius differ by less than this."""


class Avoidance:
    """Replaces commands that lead too close to moving obstacles."""

    def __init__(self, robot: RobotModel, full_speed: float) -> None:
        """Take the robot, and the full speed of the controller in m/s."""
        self._robot = robot
        self._speed = min(max(full_speed, MIN_FULL_SPEED_M_S), robot.max_linear)
        is_round = robot.circumscribed_radius - robot.inscribed_radius < MAX_ROUND_DIFFERENCE_M
        self._discs = CoveringDiscs(replace(robot, radius=robot.circumscribed_radius) if is_round else robot)
        self._last: Twist | None = None

    @cached_property
    def _sampler(self) -> TrajectorySampler:
        """Sampler of candidate trajectories; built on first use because most runs do not need it."""
        return TrajectorySampler(self._robot, self._speed)

    def reset(self) -> None:
        """Forget the last avoidance command."""
        self._last = None

    def steer(
        self,
        command: Twist,
        pose: Pose2,
        twist: Twist,
        moving: MovingObstacles,
        costmap: CostmapView,
        path: FollowedPath | None,
        home: Pose2 | None = None,
        max_speed: float = math.inf,
    ) -> Twist:
        """Return `command` itself if it is safe, otherwise the first command of the best trajectory.

        `pose`, `moving`, `costmap`, `path`, and `home` are in the same frame. A robot without a path stays near `home`,
        or near `pose` if `home` is None. `max_speed` is the speed limit in m/s at the pose.
        """
        near = moving.near(pose.x, pose.y, self._robot.circumscribed_radius + MAX_INFLATION_M, self._speed, HORIZON_S)
        followed = path if path is not None and len(path) >= 2 and command.vx != 0.0 else None
        if self._is_safe(command, pose, twist, near, followed):
            self._last = None
            return command
        rollouts = self._controller_rollouts(command, pose, twist, followed, SPEED_FRACTIONS)
        self._last = self._best_command(
            rollouts, pose, twist, near, costmap, self._position_to_approach(pose, path, home), max_speed
        )
        return self._last

    def _is_safe(
        self, command: Twist, pose: Pose2, twist: Twist, moving: MovingObstacles, followed: FollowedPath | None
    ) -> bool:
        """Return whether the controller's trajectory has a low risk, by a quick check if possible.

        `followed` is the path if the command follows it.
        """
        if not moving.obstacles:
            return True
        if followed is not None:
            position, speed, deviation = followed.position_over_time(pose, twist, command, self._robot)
            if moving.is_surely_clear(position, speed, self._discs.reach + deviation, MIN_DISTANCE_M, HORIZON_S):
                return True
        rollouts = self._controller_rollouts(command, pose, twist, followed, SPEED_FRACTIONS[:1])
        return bool(self._risk(rollouts, moving)[0] <= (SAFE_RISK if self._last is None else RESUME_RISK))

    def _best_command(
        self,
        controller_rollouts: Rollouts,
        pose: Pose2,
        twist: Twist,
        moving: MovingObstacles,
        costmap: CostmapView,
        goal: tuple[float, float],
        max_speed: float,
    ) -> Twist:
        """Return the first command of the cheapest of all trajectories: `controller_rollouts` and sampled trajectories.

        Risk and static costs take long to compute. Sampled trajectories are therefore evaluated in the order of their
        other costs, until these alone exceed the lowest total cost. At equal costs, `controller_rollouts` comes first.
        """
        fan = self._sampler.sample(pose, twist)
        all_indices = np.arange(len(fan.commands))
        # If no trajectory keeps STATIC_DISTANCE_M after 0.2 s, less is required, so that the robot can leave a wall.
        second_step = np.s_[:, 1]
        clearance = max(
            self._clearance(each, costmap, second_step).max()
            for each in (controller_rollouts, fan.rollouts(all_indices, 2))
        )
        min_clearance = min(STATIC_DISTANCE_M, float(clearance))
        cost = self._cost(controller_rollouts, pose, goal, moving, costmap, min_clearance, 0.0)
        index = int(cost.argmin())
        best, first_command = (float(cost[index]), -1), controller_rollouts.commands[index]
        cheap_costs = (
            DEVIATION_COST + self._change_costs(fan.commands) - PROGRESS_WEIGHT * self._progress(*fan.ends, pose, goal)
        )
        cheap_costs += BACKWARD_WEIGHT * self._backward_speed(fan.vx)[fan.speed_profile]
        order = cheap_costs.argsort(kind="stable")
        order = order[np.abs(fan.commands[order, 0]) <= max_speed]
        for begin in range(0, len(order), BATCH_SIZE):
            batch = order[begin : begin + BATCH_SIZE]
            if cheap_costs[batch[0]] > best[0] + ROUNDING_TOLERANCE:
                break
            cost = self._cost(fan.rollouts(batch), pose, goal, moving, costmap, min_clearance, DEVIATION_COST)
            lowest = float(cost.min())
            index = int(batch[cost == lowest].min())
            if (lowest, index) < best:
                best, first_command = (lowest, index), fan.commands[index]
        return Twist(*first_command.tolist())

    def _cost(
        self,
        rollouts: Rollouts,
        pose: Pose2,
        goal: tuple[float, float],
        moving: MovingObstacles,
        costmap: CostmapView,
        min_clearance: float,
        extra: float,
    ) -> Array:
        """Return the costs (n,) of trajectories, plus `extra`. `min_clearance` is the same as in `_static_costs`."""
        cost = self._risk(rollouts, moving)
        progress = self._progress(rollouts.x[:, -1], rollouts.y[:, -1], pose, goal)
        cost += self._static_costs(rollouts, costmap, min_clearance) - PROGRESS_WEIGHT * progress
        cost += BACKWARD_WEIGHT * self._backward_speed(rollouts.vx)
        cost += extra
        cost += self._change_costs(rollouts.commands)
        return cost

    def _controller_rollouts(
        self, command: Twist, pose: Pose2, twist: Twist, followed: FollowedPath | None, fractions: tuple[float, ...]
    ) -> Rollouts:
        """Return the controller's trajectory at fractions of its speed."""
        if followed is None:
            return arc_rollouts(pose, command, fractions if command != STOP else (1.0,))
        return followed.rollouts(pose, twist, command, fractions, self._robot, not self._discs.is_centered)

    def _risk(self, rollouts: Rollouts, moving: MovingObstacles) -> Array:
        """Return the risk (n,) of trajectories: weighted nearness to moving obstacles and collisions with them."""
        nearness, touches = self._discs.nearness(moving, rollouts.x, rollouts.y, rollouts.yaw, TIMES, MIN_DISTANCE_M)
        near = np.minimum(np.maximum(nearness, 0.0), 2.0) ** 2 * RISK_DECAY
        risk: Array = (
            APPROACH_WEIGHT * near.max(axis=1)
            + MEAN_WEIGHT * near.mean(axis=1)
            + COLLISION_WEIGHT * (touches * RISK_DECAY).max(axis=1)
        )
        return risk

    def _static_costs(self, rollouts: Rollouts, costmap: CostmapView, min_clearance: float) -> Array:
        """Return the costs (n,) of trajectories for static obstacles that are closer than `min_clearance` m."""
        is_close = self._clearance(rollouts, costmap, np.s_[:, 1::2]) < min_clearance
        cost: Array = STATIC_WEIGHT * (is_close * np.exp(-TIMES[1::2] / (2 * DECAY_TIME_S))).max(axis=1)
        return cost

    def _clearance(self, rollouts: Rollouts, costmap: CostmapView, index: tuple[slice, int | slice]) -> Reals:
        """Return the distances in m from static obstacles of the poses that `index` selects from arrays (n, times)."""
        return np.asarray(self._discs.clearance(costmap, rollouts.x[index], rollouts.y[index], rollouts.yaw[index]))

    def _position_to_approach(self, pose: Pose2, path: FollowedPath | None, home: Pose2 | None) -> tuple[float, float]:
        """Return the position (x, y) that the robot should approach."""
        if path is not None:
            return path.point_ahead(pose, self._speed * HORIZON_S)
        return (pose.x, pose.y) if home is None else (home.x, home.y)

    def _progress(self, x: Array, y: Array, pose: Pose2, goal: tuple[float, float]) -> Array:
        """Return the progress (n,) toward the goal, relative to full speed, of trajectories that end at x, y (n,)."""
        before = math.hypot(goal[0] - pose.x, goal[1] - pose.y)
        gain: Array = (before - np.hypot(x - goal[0], y - goal[1])) / (self._speed * HORIZON_S)
        return gain

    def _backward_speed(self, vx: Array) -> Array:
        """Return the mean backward speed (n,) for speeds `vx` (n, times), relative to full speed."""
        return np.asarray(np.maximum(-vx / self._speed, 0.0).mean(axis=1))

    def _change_costs(self, commands: Array) -> Array:
        """Return the costs (n,) of the difference between commands (n, 3: vx, vy, wz) and the previous command."""
        if self._last is None:
            return np.zeros(len(commands))
        change = np.abs(commands[:, 0] - self._last.vx) / self._speed
        return np.asarray(CHANGE_WEIGHT * (change + np.abs(commands[:, 2] - self._last.wz) / MAX_TURN_RATE_RAD_S))
