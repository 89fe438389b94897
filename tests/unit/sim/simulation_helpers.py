"""Helpers for tests of physics and sensors: robots, boxes, and driven motion."""

import math
from pathlib import Path

import yaml

from simscen.core.geometry import Pose2, Pose3
from simscen.core.geometry.shapes import Box, Solid
from simscen.model.robot import RobotSpec

ROBOTS = Path(__file__).parents[3] / "simscen/data/robots"


def robot_spec(name):
    """Return the specification of a shipped robot."""
    return RobotSpec.model_validate(yaml.safe_load((ROBOTS / f"{name}.robot.yaml").read_text()))


def box(name, x, y, length, width, height=1.0, yaw=0.0):
    """Return a box on the ground."""
    return Solid(Box((length, width, height)), Pose3.planar(Pose2(x, y, yaw), height / 2), name)


def measure_motion(simulation, ticks, every=6):
    """Step the simulation; return the change of heading in rad, with full turns, and the path length in m."""
    rotation = length = 0.0
    before = simulation.truth().pose.plane
    for _ in range(ticks // every):
        simulation.step(every)
        now = simulation.truth().pose.plane
        step = before.between(now)
        rotation += step.yaw
        length += math.hypot(step.x, step.y)
        before = now
    return rotation, length
