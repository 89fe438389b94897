"""Simulation of pedestrians in a recorded drive, in which the robot and other objects move as in the log.

The simulation shows whether a fitted pedestrian walks like the recorded person.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

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
"""Time step of the pedestrian simulation."""
MAX_OBSERVED_DISTANCE_M = 4.0
"""Maximum distance between a simulated pedestrian and the objects and people that are simulated in a step."""
Walker = tuple[float, WalkingPedestrian]
"""Time in s at which a pedestrian appears, and the pedestrian."""
IsGivenUp = Callable[[float, tuple[float, float]], bool]
"""Function that returns whether to end the simulation. Its arguments are the time in s and a pedestrian's position."""


class PedestrianTrial:
    """Simulates pedestrians together with the recorded robot, a disc of `robot_radius` m."""

    def __init__(self, drive: RecordedDrive, world: PedestrianMap, robot_radius: float) -> None:
        self.world = world
        self._poses, self._radius = drive.poses, robot_radius

    def robot_distances(self, times: Array, positions: Array) -> Array:
        """Return the distances (n,) in m between `positions` (n, 2) and the center of the robot at `times` (n,)."""
        distances: Array = np.hypot(*(positions - self._poses.poses_at(times)[:, :2]).T)
        return distances

    def simulate(
        self,
        walkers: Sequence[Walker],
        people: Sequence[FoundObject],
        objects: Sequence[FoundObject],
        end: float,
        is_given_up: IsGivenUp = lambda _time, _position: False,
    ) -> dict[str, tuple[Array, Array]]:
        """Simulate the pedestrians `walkers`, and return the times (n,) and positions (n, 2) of each one by name.

        The simulation ends at `end` in s, or when `is_given_up` returns True for a pedestrian. `people` and `objects`
        follow their keyframes. The simulated pedestrians treat `people` like robots, and `objects` like walls.
        """
        crowd = Crowd(self.world.walls, self.world.plan_path)
        paths: dict[str, list[tuple[float, float, float]]] = {walker.name: [] for _, walker in walkers}
        waiting = sorted(walkers, key=lambda item: item[0])
        begin = waiting[0][0]
        times = begin + STEP_S * np.arange(int((end - begin) / STEP_S + 1e-9) + 1, dtype=np.float64)
        robot = _RecordedDisc("robot", self._radius, self._poses.poses_at(times))
        discs = [_RecordedDisc(person.name, person.radius, person.poses_at(times)) for person in people]
        outlines = [_RecordedOutline(thing, times) for thing in objects]
        presence = [np.array([thing.is_present(time) for time in times.tolist()]) for thing in (*people, *objects)]
        for index, time in enumerate(times.tolist()):
            while waiting and waiting[0][0] <= time + 1e-9:
                crowd.add(waiting.pop(0)[1])
            poses = crowd.poses()
            for name, pose in poses.items():
                paths[name].append((time, pose.x, pose.y))
            if any(is_given_up(time, (pose.x, pose.y)) for pose in poses.values()):
                break
            positions = np.array([pose[:2] for pose in poses.values()])
            nearby = [
                motion
                for motion, is_present in zip((*discs, *outlines), presence, strict=True)
                if is_present[index] and motion.is_near(index, positions)
            ]
            observed_robots = tuple(
                disc.observed(index) for disc in (robot, *nearby) if isinstance(disc, _RecordedDisc)
            )
            observed_objects = tuple(item.observed(index) for item in nearby if isinstance(item, _RecordedOutline))
            crowd.step(Surroundings(observed_robots, observed_objects), STEP_S)
        arrays = {name: np.array(path).reshape(-1, 3) for name, path in paths.items()}
        return {name: (path[:, 0], path[:, 1:]) for name, path in arrays.items()}


class _RecordedMotion:
    """Robot, person, or object with a recorded pose x, y, yaw for each step of the simulation: `poses` (n, 3)."""

    def __init__(self, poses: Array) -> None:
        self.poses = poses

    def is_near(self, index: int, positions: Array) -> bool:
        """Return whether any of `positions` (m, 2) is within MAX_OBSERVED_DISTANCE_M of the pose in step `index`."""
        if not len(positions):
            return False
        return float(np.hypot(*(positions - self.poses[index, :2]).T).min()) < MAX_OBSERVED_DISTANCE_M


class _RecordedDisc(_RecordedMotion):
    """Robot or person as a disc, which pedestrians treat like a robot."""

    def __init__(self, name: str, radius: float, poses: Array) -> None:
        super().__init__(poses)
        self._name, self._radius, self._outline = name, radius, np.array(circle(radius, 12))
        has_motion = len(poses) > 1
        self._velocities: Array = np.gradient(poses[:, :2], STEP_S, axis=0) if has_motion else np.zeros((1, 2))

    def observed(self, index: int) -> ObservedRobot:
        """Return the disc in the step `index` of the simulation."""
        vx, vy = self._velocities[index].tolist()
        return ObservedRobot(self._name, Pose2(*self.poses[index].tolist()), (vx, vy), self._radius, self._outline)


class _RecordedOutline(_RecordedMotion):
    """Object as an outline, which pedestrians treat like a wall."""

    def __init__(self, thing: FoundObject, times: Array) -> None:
        super().__init__(thing.poses_at(times))
        self._name = thing.name
        if thing.is_cylinder:
            self._outline = np.array(circle(thing.size[0], 12))
        else:
            x, y = thing.size[0] / 2, thing.size[1] / 2
            self._outline = np.array([(x, y), (-x, y), (-x, -y), (x, -y)])

    def observed(self, index: int) -> ObservedObject:
        """Return the outline in the step `index` of the simulation."""
        return ObservedObject(self._name, (Pose2(*self.poses[index].tolist()).apply(self._outline),))
