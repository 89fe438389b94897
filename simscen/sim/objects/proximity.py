"""Selects the actors (movable objects) near robots. Only these must collide, or have their distances measured."""

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from simscen.core.geometry import Array, Pose3, Vector
from simscen.sim.objects.actor import Actor

EXTRA_RADIUS_M = 2.0
"""Additional search radius, so that later searches can reuse the list of nearby actors."""
REQUERY_DISTANCE_M = 1.0
"""Distance that a robot may move before the result of its last query of deferred actors becomes invalid."""
ACTIVATION_PERIOD_S = 0.05
"""Period in which the Stepper checks whether a robot must query again. In this time, a robot at 10 m/s moves by
REQUERY_DISTANCE_M - EARLY_QUERY_DISTANCE_M."""
EARLY_QUERY_DISTANCE_M = 0.5
"""Distance that a robot has moved when it queries again at a check, while its last result is still valid."""
ROUNDING_MARGIN_M = 1e-3
"""Upper bound of rounding errors in the distances of deferred actors."""


class NearbyActors(NamedTuple):
    """The actors within `distance` m of `point` at `tick`, and all pushable actors that are awake.

    asleep_since:  tick since when all pushable actors have been at rest; None if any of them is awake
    resting:       the same actors, each with its position (x, y) and the radius of its outline on the ground in m; None
                   if any of them can move
    """

    actors: tuple[Actor, ...]
    point: Vector
    distance: float
    tick: int
    asleep_since: int | None
    resting: tuple[tuple[Actor, tuple[float, float], float], ...] | None

    def covers(self, point: Vector, distance: float, tick: int, max_step: float) -> bool:
        """Return whether `actors` still has all actors within `distance` m of `point` at `tick`.

        `max_step` is an upper bound in m of the motion of any actor per tick.
        """
        return math.dist(point, self.point) + max_step * (tick - self.tick) + distance <= self.distance

    def prepare_nearby(
        self, client: int, point: Vector, distance: float, ground_distance: float, poses: Mapping[str, Pose3]
    ) -> list[int]:
        """Return the body ids of the actors within `distance` m of a point, and set their poses in the engine.

        If all actors are resting, returns the actors within `ground_distance` m, measured in the ground plane.
        """
        if self.resting is not None:
            return [
                actor.id for actor, xy, radius in self.resting if math.dist(xy, point[:2]) <= ground_distance + radius
            ]
        near = list[int]()
        for actor in self.actors:
            pose, reach = poses[actor.body.name], distance + actor.bounding_radius
            if actor.path is not None and actor.distance_to(point, pose) <= reach:
                actor.set_engine_pose(client, pose)
            if math.dist(pose[:3], point) <= reach:
                near.append(actor.id)
        return near

    def free_distance(self, point: Vector, poses: Mapping[str, Pose3], travel: float) -> float:
        """Return a lower bound in m of the distance from `point` to any actor in the simulation.

        `travel` is an upper bound in m of the motion of any actor since `tick`.
        """
        distance_to_others = self.distance - math.dist(point, self.point) - travel
        distances = (actor.distance_to(point, poses[actor.body.name]) - actor.bounding_radius for actor in self.actors)
        return min([distance_to_others, *distances])


def find_nearby(
    actors: Iterable[Actor],
    poses: Mapping[str, Pose3],
    point: Vector,
    distance: float,
    tick: int,
    asleep_since: int | None,
) -> NearbyActors:
    """Return the actors within `distance` + EXTRA_RADIUS_M of a point at the current `tick`.

    `asleep_since` is described in NearbyActors.
    """
    distance += EXTRA_RADIUS_M
    is_awake = asleep_since is None
    nearby = tuple(
        actor
        for actor in actors
        if (is_awake and actor.is_pushable)
        or actor.distance_to(point, poses[actor.body.name]) <= distance + actor.bounding_radius
    )
    resting = None
    if not any(actor.path is not None or (is_awake and actor.is_pushable) for actor in nearby):
        with_poses = ((actor, poses[actor.body.name]) for actor in nearby)
        resting = tuple((actor, pose[:2], actor.ground_radius(pose)) for actor, pose in with_poses)
    return NearbyActors(nearby, point, distance, tick, asleep_since, resting)


class ProximityQuery(NamedTuple):
    """Position of a robot and two radii in m.

    Actors within `collision_radius` must be able to collide. Actors within `distance_radius` must be in the engine, so
    that the engine can measure their distances to the robot.
    """

    point: Vector
    collision_radius: float
    distance_radius: float


class DeferredActors:
    """Actors that cannot collide in the engine yet, because no robot has come near their path.

    Deferred actors stand still or follow a fixed path. An actor is activated before a robot can reach any point of this
    path, and then stays active.
    """

    def __init__(self, actors: Sequence[Actor]) -> None:
        self._actors = actors
        segments = np.array([segment for actor in actors for segment in actor.segments])
        self._owners = np.repeat(np.arange(len(actors)), [len(actor.segments) for actor in actors])
        """Index of the actor of each segment."""
        self._starts, self._directions = segments[:, :2], segments[:, 2:4] - segments[:, :2]
        self._squared_lengths = np.maximum((self._directions**2).sum(axis=1), 1e-12)
        bounding_radii = np.array([actor.bounding_radius for actor in actors])[self._owners]
        self._radii = segments[:, 4] + bounding_radii + ROUNDING_MARGIN_M
        self._is_deferred = np.ones(len(actors), dtype=np.bool_)
        self._is_measured = np.zeros(len(actors), dtype=np.bool_)

    def activate_near(self, queries: Iterable[ProximityQuery]) -> tuple[list[Actor], list[Actor]]:
        """Return the newly activated actors, and other actors that the engine needs only to measure their distances.

        The results are valid until a robot has moved by REQUERY_DISTANCE_M.
        """
        is_near, is_measured = np.zeros((2, len(self._actors)), dtype=np.bool_)
        for point, collision_radius, distance_radius in queries:
            distances = self._distances(point) - REQUERY_DISTANCE_M
            is_near[self._owners[distances <= collision_radius]] = True
            is_measured[self._owners[distances <= distance_radius]] = True
        is_near &= self._is_deferred
        self._is_deferred &= ~is_near
        is_measured &= self._is_deferred & ~self._is_measured
        self._is_measured |= is_measured
        near, measured = (np.flatnonzero(chosen).tolist() for chosen in (is_near, is_measured))
        return [self._actors[index] for index in near], [self._actors[index] for index in measured]

    def _distances(self, point: Vector) -> Array:
        """Return lower bounds of the distance in m from a point to the actors, one for each segment of their paths."""
        offsets = np.array(point[:2]) - self._starts
        shares = np.clip((offsets * self._directions).sum(axis=1) / self._squared_lengths, 0.0, 1.0)
        centers = offsets - shares[:, np.newaxis] * self._directions
        distances: Array = np.linalg.norm(centers, axis=1) - self._radii
        return distances
