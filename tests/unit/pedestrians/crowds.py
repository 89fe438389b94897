"""Crowds, walls, and robots for tests of pedestrians, and a loop that lets a crowd walk."""

import math

import numpy as np

from simscen.core.environment.world_model import PedestrianEvent, WalkingPedestrian
from simscen.core.geometry import Pose2
from simscen.pedestrians.crowd import Crowd
from simscen.pedestrians.surroundings import ObservedRobot, Surroundings, WallMap

STEP_S = 0.05
SQUARE = np.array([(0.2, 0.2), (-0.2, 0.2), (-0.2, -0.2), (0.2, -0.2)])
"""Footprint of a robot with a radius of 0.2 m."""


def walls(*segments) -> WallMap:
    ends = np.array(segments, dtype=float).reshape(-1, 2, 2)
    return WallMap(ends, np.arange(len(ends)), np.ones(len(ends), dtype=bool))


def corridor(width: float, length: float = 100.0) -> WallMap:
    return walls(*([[-length, y], [length, y]] for y in (-width / 2, width / 2)))


def make_crowd(*walkers: WalkingPedestrian, wall_map: WallMap | None = None) -> Crowd:
    """Return a crowd of `walkers` who walk straight to their goals."""
    crowd = Crowd(wall_map or walls(), lambda _start, goal, _radius: [goal])
    for walker in walkers:
        crowd.add(walker)
    return crowd


def walker(name: str, x: float, y: float, *goals: tuple[float, float], **settings) -> WalkingPedestrian:
    """Return a pedestrian who faces the first goal, or east without goals, unless `settings` contain a yaw."""
    yaw = math.atan2(goals[0][1] - y, goals[0][0] - x) if goals else 0.0
    return WalkingPedestrian(name, Pose2(x, y, settings.pop("yaw", yaw)), goals, **settings)


def robot(
    x: float, y: float, yaw: float = 0.0, speed: float = 0.0, name: str = "", radius: float = 0.2
) -> ObservedRobot:
    velocity = speed * math.cos(yaw), speed * math.sin(yaw)
    return ObservedRobot(name, Pose2(x, y, yaw), velocity, radius, SQUARE * radius / 0.2)


def walk(crowd: Crowd, seconds: float, *robots: ObservedRobot) -> tuple[dict[str, np.ndarray], list[PedestrianEvent]]:
    """Step the crowd while the robots keep their velocities.

    Returns the track of each pedestrian, with the rows x, y, yaw before the first step and after each step, and all
    events.
    """
    tracks = {name: [pose] for name, pose in crowd.poses().items()}
    events: list[PedestrianEvent] = []
    for step in range(round(seconds / STEP_S)):
        moved = tuple(_move(robot, step * STEP_S) for robot in robots)
        events += crowd.step(Surroundings(moved), STEP_S)
        for name, pose in crowd.poses().items():
            tracks[name].append(pose)
    return {name: np.array(track) for name, track in tracks.items()}, events


def _move(robot: ObservedRobot, seconds: float) -> ObservedRobot:
    """Return the robot after `seconds` at its velocity."""
    pose = Pose2(robot.pose.x + seconds * robot.velocity[0], robot.pose.y + seconds * robot.velocity[1], robot.pose.yaw)
    return ObservedRobot(robot.name, pose, robot.velocity, robot.radius, robot.outline)
