"""Predicted motion of obstacles in planning: additional costs, and a check whether a path meets an obstacle."""

import math
from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from simscen.advanced.prediction.avoidance import MIN_DISTANCE_M
from simscen.advanced.prediction.rollouts import HORIZON_S
from simscen.core.geometry import Pose2
from simscen.stack.moving_obstacles import MAX_INFLATION_M, MovingObstacles
from simscen.stack.protocols import MAX_NON_OBSTACLE, CostmapView

DECAY_TIME_S = 2.0
"""Time constant of the exponential decay of costs with the time of arrival, because obstacles change their velocity."""
BLOCK_SIZE_M = 0.2
"""Approximate side length of the blocks of cells that get the same cost."""


def add_predicted_costs(costmap: CostmapView, robot: Pose2, speed: float, radius: float) -> CostmapView:
    """Return the costmap with costs, up to MAX_NON_OBSTACLE, in cells where the robot would meet moving obstacles.

    The robot is assumed to drive straight from the pose `robot` to each cell at `speed` m/s. The obstacles are
    predicted for the time of arrival. `radius` is the radius of the robot in m.
    """
    if not len(costmap.moving):
        return costmap
    size, (height, width) = costmap.resolution, costmap.costs.shape
    factor = max(1, round(BLOCK_SIZE_M / size))
    low, high, centers = [], [], []
    for center, corner, cells in ((robot.y, costmap.origin[1], height), (robot.x, costmap.origin[0], width)):
        first = max(0, math.floor((center - speed * HORIZON_S - corner) / size))
        last = min(cells, math.ceil((center + speed * HORIZON_S - corner) / size))
        low.append(first)
        high.append(max(first, last))
        centers.append(corner + size * (first + factor * (np.arange(-(-max(0, last - first) // factor)) + 0.5)))
    x, y = np.meshgrid(centers[1], centers[0])
    times = np.hypot(x - robot.x, y - robot.y) / speed
    nearness, _ = costmap.moving.nearness(x, y, times, radius, MIN_DISTANCE_M)
    cost = MAX_NON_OBSTACLE * np.clip(nearness, 0.0, 1.0) * np.exp(-times / DECAY_TIME_S)
    predicted = np.where(times > HORIZON_S, 0.0, cost).astype(np.uint8)
    if not predicted.any():
        return costmap
    window = slice(low[0], high[0]), slice(low[1], high[1])
    cells = predicted.repeat(factor, axis=0).repeat(factor, axis=1)[: high[0] - low[0], : high[1] - low[1]]
    costs = costmap.costs.copy()
    np.maximum(costs[window], cells, out=costs[window])
    return replace(costmap, costs=costs)


def meets_moving_obstacle(
    moving: MovingObstacles, robot: Pose2, path: Iterable[complex], speed: float, radius: float
) -> bool:
    """Return whether a robot that drives from `robot` along `path` (points x + iy) comes too close to an obstacle.

    Obstacles are predicted for HORIZON_S. Too close means that `MovingObstacles.nearness` is positive. The `speed` is
    in m/s, and the robot's `radius` in m.
    """
    moving = moving.near(robot.x, robot.y, radius + MAX_INFLATION_M, speed, HORIZON_S)
    if not moving.obstacles:
        return False
    position, driven = complex(robot.x, robot.y), 0.0
    for point in path:
        driven += abs(point - position)
        position, time = point, driven / speed
        if time >= HORIZON_S:
            return False
        for obstacle in moving.obstacles:
            distance = min(MIN_DISTANCE_M + obstacle.position_std(time, moving.acceleration), MAX_INFLATION_M)
            if abs(point - obstacle.position - time * obstacle.velocity) - obstacle.radius < radius + distance:
                return True
    return False
