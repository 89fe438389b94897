"""Simulation of pedestrians in a recorded drive: the robot and other objects move as the log shows."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from simscen.core.environment.world_model import WalkingPedestrian
from simscen.core.geometry import Array, Pose2
from simscen.pedestrians.crowd import Crowd
from simscen.pedestrians.surroundings import ObservedObject, ObservedRobot, Surroundings
from simscen.reconstruction.drive.recorded_drive import RecordedDrive
from simscen.reconstruction.objects.found_object import FoundObject
from simscen.run.live_world.pedestrians import PedestrianMap
from simscen.sim.body.outline import circle

STEP_S = 0.05
"""Step of the pedestrian model."""
NEAR_M = 4.0
"""Distance from a pedestrian within which others count."""
Walker = tuple[float, WalkingPedestrian]
"""Time in s at which a pedestrian appears, and the pedestrian."""
IsGivenUp = Callable[[float, tuple[float, float]], bool]
"""Returns whether a pedestrian at a time and a position is so far from its track that the rest does not matter."""


class PedestrianTrial:
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
        walkers: Sequence[Walker],
        people: Sequence[FoundObject],
        objects: Sequence[FoundObject],
        end: float,
        is_given_up: IsGivenUp = lambda _time, _position: False,
    ) -> dict[str, tuple[Array, Array]]:
        """Return times (n,) and positions (n, 2) of each of `walkers` until `end`, or until one is given up.

        `people` and `objects` follow their keyframes; the walkers evade `people` as other pedestrians.
        """
        crowd = Crowd(self.world.walls, self.world.plan_path)
        paths: dict[str, list[tuple[float, float, float]]] = {walker.name: [] for _, walker in walkers}
        waiting = sorted(walkers, key=lambda item: item[0])
        begin = waiting[0][0]
        times = begin + STEP_S * np.arange(int((end - begin) / STEP_S + 1e-9) + 1, dtype=np.float64)
        robot = _MovingDisc("robot", self._radius, self._poses.poses_at(times))
        discs = [_MovingDisc(person.name, person.radius, person.poses_at(times)) for person in people]
        outlines = [_MovingOutline(thing, times) for thing in objects]
        present = [np.array([thing.is_there(time) for time in times.tolist()]) for thing in (*people, *objects)]
        for index, time in enumerate(times.tolist()):
            while waiting and waiting[0][0] <= time + 1e-9:
                crowd.add(waiting.pop(0)[1])
            poses = crowd.poses()
            for name, pose in poses.items():
                paths[name].append((time, pose.x, pose.y))
            if any(is_given_up(time, (pose.x, pose.y)) for pose in poses.values()):
                break
            places = np.array([pose[:2] for pose in poses.values()])
            near = [
                thing
                for thing, is_present in zip((*discs, *outlines), present, strict=True)
                if is_present[index] and thing.is_near(index, places)
            ]
            robots = tuple(disc.observed(index) for disc in (robot, *near) if isinstance(disc, _MovingDisc))
            things = tuple(one.observed(index) for one in near if isinstance(one, _MovingOutline))
            crowd.step(Surroundings(robots, things), STEP_S)
        return {name: (path[:, 0], path[:, 1:]) for name, path in _arrays(paths)}


def _arrays(paths: dict[str, list[tuple[float, float, float]]]) -> Iterator[tuple[str, Array]]:
    for name, path in paths.items():
        yield name, np.array(path).reshape(-1, 3)


class _Moving:
    """Something that follows its poses (n, 3), one for each step."""

    def __init__(self, poses: Array) -> None:
        self.poses = poses

    def is_near(self, index: int, places: Array) -> bool:
        """Return whether it is within NEAR_M of one of the places (m, 2)."""
        return bool(len(places)) and float(np.hypot(*(places - self.poses[index, :2]).T).min()) < NEAR_M


class _MovingDisc(_Moving):
    """A robot or a person, whom pedestrians evade as another pedestrian."""

    def __init__(self, name: str, radius: float, poses: Array) -> None:
        super().__init__(poses)
        self._name, self._radius, self._outline = name, radius, np.array(circle(radius, 12))
        several = len(poses) > 1
        self._velocities: Array = np.gradient(poses[:, :2], STEP_S, axis=0) if several else np.zeros((1, 2))

    def observed(self, index: int) -> ObservedRobot:
        vx, vy = self._velocities[index].tolist()
        return ObservedRobot(self._name, Pose2(*self.poses[index].tolist()), (vx, vy), self._radius, self._outline)


class _MovingOutline(_Moving):
    """An object, which pedestrians avoid as a wall."""

    def __init__(self, thing: FoundObject, times: Array) -> None:
        super().__init__(thing.poses_at(times))
        self._name = thing.name
        if thing.is_cylinder:
            self._outline = np.array(circle(thing.size[0], 12))
        else:
            x, y = thing.size[0] / 2, thing.size[1] / 2
            self._outline = np.array([(x, y), (-x, y), (-x, -y), (x, -y)])

    def observed(self, index: int) -> ObservedObject:
        return ObservedObject(self._name, (Pose2(*self.poses[index].tolist()).apply(self._outline),))
