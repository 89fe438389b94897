"""Costmaps and scans of simple rooms for tests."""

import math

import numpy as np

from simscen.core.geometry import Pose2
from simscen.core.messages.sensor_data import Scan
from simscen.model.costmaps import Costmap as Spec
from simscen.stack.costmap.layered_costmap import LayeredCostmap
from simscen.stack.protocols import Surroundings
from simscen.testing.flatland import TICK_RATE_HZ, Flatland, round_robot

ROBOT = round_robot()
BOUNDS = (-0.5, -0.5, 8.5, 6.5)


def scan_of(world: Flatland, pose: Pose2, beams: int = 360, range_max: float = 12.0, noise: float = 0.0) -> Scan:
    """Return a scan of a full circle in the world; `noise` is the standard deviation of the ranges in m."""
    step = 2 * math.pi / beams
    angles = -math.pi + step * np.arange(beams)
    ranges = world.cast((pose.x, pose.y), angles + pose.yaw)
    ranges = ranges + np.random.default_rng(3).normal(0, noise, beams)
    return Scan("lidar", 0, np.where(ranges > range_max, np.inf, ranges), -math.pi, step, 0.05, range_max)


def costmap(world: Flatland | None, spec: Spec | None = None, **options: object) -> LayeredCostmap:
    """Return the costmap of a round robot with the map of the world, or without a map if `world` is None."""
    grid = world.grid(BOUNDS) if world else None
    return LayeredCostmap(spec or Spec(), Surroundings(ROBOT, grid, TICK_RATE_HZ, **options))


def cost_and_distance_at(costmap: LayeredCostmap, x: float, y: float) -> tuple[int, float]:
    """Return the cost of the cell at a point in m, and its distance in m to the nearest obstacle."""
    view = costmap.view
    row, column = int((y - view.origin[1]) / view.resolution), int((x - view.origin[0]) / view.resolution)
    return int(view.costs[row, column]), float(view.distance[row, column])
