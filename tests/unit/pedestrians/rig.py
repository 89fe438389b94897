"""What tests of people build: walls of segments, a robot, and a stretch of time."""

import math

import numpy as np

from simscen.core.environment.world_model import PedestrianEvent, WalkingPedestrian
from simscen.core.geometry import Pose2
from simscen.pedestrians.crowd import Crowd
from simscen.pedestrians.surroundings import ObservedRobot, Surroundings, WallMap

STEP = 0.05
SQUARE = np.array([(0.2, 0.2), (-0.2, 0.2), (-0.2, -0.2), (0.2, -0.2)])


def walls(*segments) -> WallMap:
    ends = np.array(segments, dtype=float).reshape(-1, 2, 2)
    return WallMap(ends, np.arange(len(ends)), np.ones(len(ends), dtype=bool))


def corridor(width: float, length: float = 100.0) -> WallMap:
    return walls(*([[-length, y], [length, y]] for y in (-width / 2, width / 2)))


def people(*walkers: WalkingPedestrian, around: WallMap | None = None) -> Crowd:
    crowd = Crowd(around or walls(), lambda _start, goal, _radius: [goal])
    for walker in walkers:
        crowd.add(walker)
    return crowd


def walker(name: str, x: float, y: float, *goals: tuple[float, float], **more) -> WalkingPedestrian:
    """Who faces their first goal, or east."""
    yaw = math.atan2(goals[0][1] - y, goals[0][0] - x) if goals else 0.0
    return WalkingPedestrian(name, Pose2(x, y, more.pop("yaw", yaw)), goals, **more)


def robot(
    x: float, y: float, yaw: float = 0.0, speed: float = 0.0, name: str = "", radius: float = 0.2
) -> ObservedRobot:
    velocity = speed * math.cos(yaw), speed * math.sin(yaw)
    return ObservedRobot(name, Pose2(x, y, yaw), velocity, radius, SQUARE * radius / 0.2)


def walk(crowd: Crowd, seconds: float, *robots: ObservedRobot) -> tuple[dict[str, np.ndarray], list[PedestrianEvent]]:
    """Everybody's x, y, yaw at each step, the first before it; and what they did. Robots drive on as they do."""
    tracks = {name: [pose] for name, pose in crowd.poses().items()}
    events: list[PedestrianEvent] = []
    for number in range(round(seconds / STEP)):
        now = tuple(_driven(one, number * STEP) for one in robots)
        events += crowd.step(Surroundings(now), STEP)
        for name, pose in crowd.poses().items():
            tracks[name].append(pose)
    return {name: np.array(track) for name, track in tracks.items()}, events


def _driven(one: ObservedRobot, seconds: float) -> ObservedRobot:
    pose = Pose2(one.pose.x + seconds * one.velocity[0], one.pose.y + seconds * one.velocity[1], one.pose.yaw)
    return ObservedRobot(one.name, pose, one.velocity, one.radius, one.outline)
