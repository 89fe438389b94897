"""Simulation of all pedestrians of a world with the social force model."""

import math
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from simscen.core.environment.world_model import PedestrianEvent, WalkingPedestrian
from simscen.core.geometry import Array, Pose2
from simscen.pedestrians import forces
from simscen.pedestrians.forces import RELAXATION_TIME_S, Indices
from simscen.pedestrians.move_limits import clip_moves, move_limits
from simscen.pedestrians.pedestrian import SCARED_FORCE_M2_S2, THREATENING_SPEED_M_S, Intent, Pedestrian
from simscen.pedestrians.surroundings import (
    NearestPoints,
    ObservedRobot,
    Surroundings,
    WallMap,
    nearest_by_solid,
    nearest_outline_points,
)

INTERACTION_RANGE_M = 10.0
"""Maximum distance at which social forces act (HuNavSim's max_dist_view)."""
MIN_SOCIAL_FORCE_M_S2 = 0.05
"""Weaker social forces count as 0, so that a new pedestrian does not affect pedestrians far away."""
VIEW_CHECK_STEPS = 20
"""A pedestrian checks in every n-th step that no wall hides the next corner of its path."""
MIN_SPEED_M_S = 0.01
"""A pedestrian stands still if its velocity, and the velocity that the forces lead to, are below this speed."""
REFERENCE_RADIUS_M = 0.25
"""Body radius for which the parameters of the social force model were determined."""

Point = tuple[float, float]
"""(x, y) in m in the world frame."""
PathPlanner = Callable[[Point, Point, float], list[Point]]
"""Function (start, goal, radius in m) that returns the corners of a path around walls; the last corner is the goal."""


class Crowd:
    """Simulates all pedestrians of a world, in the order of their names and without random numbers."""

    def __init__(self, walls: WallMap, plan_path: PathPlanner) -> None:
        self._walls, self._plan_path = walls, plan_path
        self._people: dict[str, Pedestrian] = {}
        self._steps = 0

    def add(self, spec: WalkingPedestrian) -> None:
        """Add a pedestrian at its initial pose. Replaces a pedestrian with the same name."""
        self._people[spec.name] = Pedestrian(spec, spec.pose, has_arrived=not spec.goals)
        self._people = dict(sorted(self._people.items()))

    def remove(self, name: str) -> None:
        """Remove a pedestrian."""
        del self._people[name]

    def poses(self) -> dict[str, Pose2]:
        """Return the poses of all pedestrians by name."""
        return {name: person.pose for name, person in self._people.items()}

    def radius(self, name: str) -> float:
        """Return the body radius of a pedestrian in m."""
        return self._people[name].spec.radius

    def top_speed(self, name: str) -> float:
        """Return an upper bound in m/s on the walking speed of a pedestrian, whatever its behavior."""
        spec = self._people[name].spec
        return max(forces.MAX_SPEED_RATIO * spec.speed, THREATENING_SPEED_M_S)

    def step(self, surroundings: Surroundings, seconds: float) -> list[PedestrianEvent]:
        """Move all pedestrians by one step of `seconds`.

        Returns the events of this step: a pedestrian began or ended a reaction, or reached a goal.
        """
        people = list(self._people.values())
        if not people:
            return []
        target_robots, events = self._update_reactions(people, surroundings, seconds)
        for number, person in enumerate(people):
            self._update_path(person, number)
        intents = [person.intent(robot) for person, robot in zip(people, target_robots, strict=True)]
        positions = np.array([person.position for person in people])
        velocities = np.array([person.velocity for person in people])
        walls = self._walls.nearest_points(positions)
        external = self._external_forces(people, target_robots, intents, positions, velocities, surroundings, walls)
        moves, new_velocities = _integrate(intents, positions, velocities, external, seconds)
        clipped_moves = clip_moves(moves, move_limits(people, positions, surroundings, walls))
        is_clipped = (clipped_moves != moves).any(axis=1)
        new_velocities[is_clipped] = clipped_moves[is_clipped] / seconds
        for person, move, velocity, intent in zip(people, clipped_moves, new_velocities, intents, strict=True):
            person.move(move, velocity, intent.looks_at, seconds)
            events += person.update_goal()
        self._steps += 1
        return events

    def _update_reactions(
        self, people: list[Pedestrian], surroundings: Surroundings, seconds: float
    ) -> tuple[list[ObservedRobot | None], list[PedestrianEvent]]:
        """Begin and end reactions to robots in a step of `seconds`.

        Returns for each pedestrian the robot that the pedestrian reacts to, or None; and one event for each reaction
        that began or ended.
        """
        target_robots: list[ObservedRobot | None] = []
        events: list[PedestrianEvent] = []
        for person in people:
            visible: dict[str, ObservedRobot] = {}
            if person.spec.reacts_within and "robots" not in person.spec.blind_to:
                visible = {r.name: r for r in surroundings.robots if self._sees(person, r.pose[:2])}
                events += person.update_reaction(visible, seconds)
            target_robots.append(None if person.reacts_to is None else visible.get(person.reacts_to))
        return target_robots, events

    def _sees(self, person: Pedestrian, point: Point) -> bool:
        """Return whether no wall hides a point from a pedestrian, regardless of the field of view."""
        return bool(self._walls.visible(np.array([person.position]), np.array([point]))[0])

    def _update_path(self, person: Pedestrian, number: int) -> None:
        """Plan a path if the goal is new, or if a wall hides the next corner of the path.

        `number` is the index of the pedestrian. It distributes the checks of several pedestrians over several steps.
        """
        goal = person.destination
        is_outdated = person.planned_goal != goal
        if not is_outdated and person.path and (self._steps + number) % VIEW_CHECK_STEPS == 0:
            is_outdated = not self._sees(person, person.path[0])
        if is_outdated:
            person.path, person.planned_goal = self._plan_path(person.position, goal, person.spec.radius), goal

    def _external_forces(
        self,
        people: list[Pedestrian],
        target_robots: list[ObservedRobot | None],
        intents: list[Intent],
        positions: Array,
        velocities: Array,
        surroundings: Surroundings,
        walls: NearestPoints,
    ) -> Array:
        """Return the sum (n, 2) in m/s² of all forces on each pedestrian, except the driving force to the target."""
        force = self._social_forces(people, target_robots, positions, velocities, surroundings)
        force += self._obstacle_forces(people, positions, surroundings, walls)
        for members in _groups(people):
            force[members] += forces.group_forces(positions[members], velocities[members])
        for number, (person, robot, intent) in enumerate(zip(people, target_robots, intents, strict=True)):
            if intent.is_immovable:
                force[number] = 0.0
            elif robot is not None and person.spec.behavior == "scared":
                away = positions[number] - np.array(robot.pose[:2])
                distance = max(math.hypot(*away), 1e-6)
                force[number] += SCARED_FORCE_M2_S2 / max(distance - person.spec.radius, 0.1) * away / distance
        return force

    def _social_forces(
        self,
        people: list[Pedestrian],
        target_robots: list[ObservedRobot | None],
        positions: Array,
        velocities: Array,
        surroundings: Surroundings,
    ) -> Array:
        """Return the forces (n, 2) in m/s² with which pedestrians evade each other and robots."""
        # The others are all pedestrians, followed by all robots.
        robots = surroundings.robots
        other_positions = np.concatenate((positions, np.array([robot.pose[:2] for robot in robots]).reshape(-1, 2)))
        other_velocities = np.concatenate((velocities, np.array([robot.velocity for robot in robots]).reshape(-1, 2)))
        radii = np.array([*(person.spec.radius for person in people), *(robot.radius for robot in robots)])
        offsets = other_positions[np.newaxis] - positions[:, np.newaxis]
        interacts = np.hypot(offsets[..., 0], offsets[..., 1]) <= INTERACTION_RANGE_M
        np.fill_diagonal(interacts, False)
        interacts &= _evades(people, target_robots, surroundings)
        person, other = np.nonzero(interacts)
        force = forces.social_forces(
            offsets[person, other], velocities[person] - other_velocities[other], radii[other] - REFERENCE_RADIUS_M
        )
        is_strong = np.hypot(force[:, 0], force[:, 1]) > MIN_SOCIAL_FORCE_M_S2
        person, other, force = person[is_strong], other[is_strong], force[is_strong]
        visible = self._walls.visible(positions[person], other_positions[other])
        return _sum_by_person(person[visible], force[visible], len(people))

    def _obstacle_forces(
        self, people: list[Pedestrian], positions: Array, surroundings: Surroundings, walls: NearestPoints
    ) -> Array:
        """Return the forces (n, 2) in m/s² of walls and objects on pedestrians.

        For pedestrians with the behavior `impassive`, robots are objects.
        """
        person, solid, nearest = walls
        first = nearest_by_solid(person, solid, np.hypot(*(nearest - positions[person]).T))
        contacts = [(person[first], nearest[first])]
        aware = np.array([k for k, p in enumerate(people) if "objects" not in p.spec.blind_to], np.int64)
        contacts += [nearest_outline_points(item.outlines, aware, positions) for item in surroundings.objects]
        impassive = np.array([k for k, p in enumerate(people) if p.spec.behavior == "impassive"
                              and "robots" not in p.spec.blind_to], np.int64)  # fmt: skip
        for robot in surroundings.robots:
            contacts.append(nearest_outline_points([robot.pose.apply(robot.outline)], impassive, positions))
        person = np.concatenate([indices for indices, _ in contacts])
        away = positions[person] - np.concatenate([points for _, points in contacts])
        distance = np.maximum(np.hypot(away[:, 0], away[:, 1]), 1e-9)
        radii = np.array([p.spec.radius for p in people])
        force = forces.wall_forces(away / distance[:, np.newaxis], distance - radii[person])
        return _sum_by_person(person, force, len(people))


def _evades(
    people: list[Pedestrian], target_robots: list[ObservedRobot | None], surroundings: Surroundings
) -> npt.NDArray[np.bool_]:
    """Return a matrix: whether each pedestrian (row) evades each pedestrian or robot (column) by social forces.

    The columns are all pedestrians, followed by all robots.
    """
    evades = np.ones((len(people), len(people) + len(surroundings.robots)), dtype=np.bool_)
    for number, (person, target_robot) in enumerate(zip(people, target_robots, strict=True)):
        if "people" in person.spec.blind_to:
            evades[number, : len(people)] = False
        if "robots" in person.spec.blind_to or person.spec.behavior == "impassive":
            evades[number, len(people) :] = False
        elif target_robot is not None:
            is_other = [robot.name != target_robot.name for robot in surroundings.robots]
            evades[number, len(people) :] &= np.array(is_other)
    return evades


def _groups(people: list[Pedestrian]) -> list[Indices]:
    """Return the indices of the members of each group of at least two pedestrians.

    Pedestrians that react to a robot are left out.
    """
    names = sorted({person.spec.group for person in people if person.spec.group is not None})
    groups = [[k for k, p in enumerate(people) if p.spec.group == name and p.reacts_to is None] for name in names]
    return [np.array(members) for members in groups if len(members) > 1]


def _integrate(
    intents: list[Intent], positions: Array, velocities: Array, external: Array, seconds: float
) -> tuple[Array, Array]:
    """Return moves (n, 2) in m during a step of `seconds`, and velocities (n, 2) in m/s at its end.

    Solves dv/dt = (intended velocity - v) / τ + force exactly for the constant `external` forces (n, 2) in m/s², and
    limits moves and velocities to the maximum speeds.
    """
    intended = np.zeros_like(positions)
    for number, intent in enumerate(intents):
        if intent.target is not None:
            offset = np.array(intent.target) - positions[number]
            distance = math.hypot(*offset)
            intended[number] = intent.speed * offset / distance if distance > 0 else 0.0
    steady = intended + RELAXATION_TIME_S * external
    decay = math.exp(-seconds / RELAXATION_TIME_S)
    max_speeds = np.array([intent.max_speed for intent in intents])
    new_velocities = _limit_lengths(steady + (velocities - steady) * decay, max_speeds)
    moves = steady * seconds + (velocities - steady) * RELAXATION_TIME_S * (1 - decay)
    is_standing = (np.hypot(*steady.T) < MIN_SPEED_M_S) & (np.hypot(*velocities.T) < MIN_SPEED_M_S)
    moves[is_standing] = new_velocities[is_standing] = 0.0
    return _limit_lengths(moves, max_speeds * seconds), new_velocities


def _limit_lengths(vectors: Array, limits: Array) -> Array:
    """Return vectors (n, 2), shortened to the lengths `limits` (n,) if they are longer."""
    lengths = np.hypot(vectors[:, 0], vectors[:, 1])
    limited: Array = vectors * np.minimum(1.0, limits / np.maximum(lengths, 1e-12))[:, np.newaxis]
    return limited


def _sum_by_person(person: Indices, force: Array, count: int) -> Array:
    """Return the sum (count, 2) of the forces (n, 2) on each pedestrian. `person` (n,): index of each pedestrian."""
    sums = [np.bincount(person, force[:, axis], minlength=count) for axis in (0, 1)]
    return np.stack(sums, axis=1).astype(np.float64)  # without any force, bincount returns integers
