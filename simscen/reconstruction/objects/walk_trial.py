"""Simulation of pedestrians in a recorded drive: the robot and other objects move as the log shows."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from simscen.core.environment.world_model import WalkingPedestrian
from simscen.core.geometry import Array, Pose2
from simscen.pedestrians.crowd import Crowd
from simscen.pedestrians.surroundings import ObservedObject, ObservedRobot, Surroundings
from simscen.reconstruction.drive.recorded_drive import RecordedDrive
from simscen.reconstruction.objects.found_object import FoundObject
from simscen.run.live_world.pedestrian_map import PedestrianMap
from simscen.sim.body.outline import circle

STEP_S = 0.05
"""Step of the pedestrian model."""
VELOCITY_SPAN_S = 0.5


class WalkTrial:
    """Simulates pedestrians beside the recorded robot, a disc of `robot_radius` m."""

    def __init__(self, drive: RecordedDrive, world: PedestrianMap, robot_radius: float) -> None:
        self.world = world
        self._poses, self._radius = drive.poses, robot_radius

    def robot_distances(self, times: Array, positions: Array) -> Array:
        """Return the distances (n,) in m of `positions` (n, 2) at `times` (n,) from the center of the robot."""
        distances: Array = np.hypot(*(positions - self._poses.poses_at(times)[:, :2]).T)
        return distances

    def positions(
        self,
        walkers: Sequence[tuple[float, WalkingPedestrian]],
        people: Sequence[FoundObject],
        objects: Sequence[FoundObject],
        end: float,
    ) -> dict[str, tuple[Array, Array]]:
        """Return times (n,) and positions (n, 2) of each of `walkers`, which appear at the time before each.

        `people` and `objects` follow their keyframes; the walkers evade `people` as other pedestrians.
        """
        crowd = Crowd(self.world.walls, self.world.plan_path)
        paths: dict[str, list[tuple[float, float, float]]] = {walker.name: [] for _, walker in walkers}
        time = min(begin for begin, _ in walkers)
        waiting = sorted(walkers, key=lambda item: item[0])
        while time <= end + 1e-9:
            while waiting and waiting[0][0] <= time + 1e-9:
                crowd.add(waiting.pop(0)[1])
            for name, pose in crowd.poses().items():
                paths[name].append((time, pose.x, pose.y))
            crowd.step(self._surroundings(time, people, objects), STEP_S)
            time += STEP_S
        arrays = {name: np.array(path).reshape(-1, 3) for name, path in paths.items()}
        return {name: (path[:, 0], path[:, 1:]) for name, path in arrays.items()}

    def _surroundings(self, time: float, people: Sequence[FoundObject], objects: Sequence[FoundObject]) -> Surroundings:
        around = np.array([time - VELOCITY_SPAN_S / 2, time, time + VELOCITY_SPAN_S / 2])
        robots = [_disc("robot", self._poses.poses_at(around), self._radius)]
        for person in people:
            if person.is_there(time):
                robots.append(_disc(person.name, person.poses_at(around), person.radius))
        outlines = [ObservedObject(thing.name, (_outline(thing, time),)) for thing in objects if thing.is_there(time)]
        return Surroundings(tuple(robots), tuple(outlines))


def _disc(name: str, poses: Array, radius: float) -> ObservedRobot:
    """Return a round robot from its poses (3, 3) before, at, and after a time."""
    vx, vy = ((poses[2, :2] - poses[0, :2]) / VELOCITY_SPAN_S).tolist()
    return ObservedRobot(name, Pose2(*poses[1].tolist()), (vx, vy), radius, np.array(circle(radius)))


def _outline(thing: FoundObject, time: float) -> Array:
    pose = Pose2(*thing.poses_at(np.array([time]))[0].tolist())
    if thing.is_cylinder:
        return pose.apply(np.array(circle(thing.size[0])))
    x, y = thing.size[0] / 2, thing.size[1] / 2
    return pose.apply(np.array([(x, y), (-x, y), (-x, -y), (x, -y)]))
