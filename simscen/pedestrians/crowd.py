"""Everybody who walks, and one step of the social force model for all of them together."""

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from simscen.core.environment.world_model import PedestrianAction, WalkingPedestrian
from simscen.core.geometry import Array, Pose2
from simscen.pedestrians import forces
from simscen.pedestrians.forces import RELAXATION_TIME, MoveLimits, Numbers, clip_moves, move_limits
from simscen.pedestrians.pedestrian import SCARED_FORCE, THREATENING_SPEED, Intent, Pedestrian
from simscen.pedestrians.surroundings import REACH, Near, ObservedRobot, Surroundings, WallMap, edges, nearest_on

VIEW = 10.0
"""m beyond which nobody minds anybody (HuNavSim's max_dist_view)."""
UNFELT = 0.05
"""m/s²; a weaker force from another is none, so that who comes into the world changes nobody far away."""
PATIENCE = 20
"""Steps after which somebody looks whether the way to go on is still in view."""
CREEP = 0.01
"""m/s; who would walk more slowly stands."""
OWN_WIDTH = 0.25
"""m; the radius of those by whom the model's parameters were found."""

Point = tuple[float, float]
Flags = npt.NDArray[np.bool_]
FindWay = Callable[[Point, Point, float], list[Point]]
"""Gives the corners of a way around walls for a body of a radius in m, from one place to another, which is the last."""


def straight_path(_start: Point, goal: Point, _radius: float) -> list[Point]:
    """Return a straight path, for pedestrians without a map."""
    return [goal]


class _Others(NamedTuple):
    """Those whom somebody may mind as persons: everybody, then the robots."""

    places: Array
    velocities: Array
    wider: Array


class Crowd:
    """Everybody in one world, in the order of their names; nothing in it draws chance."""

    def __init__(self, walls: WallMap, find_way: FindWay = straight_path) -> None:
        self._walls, self._find_way = walls, find_way
        self._people: dict[str, Pedestrian] = {}
        self._steps = 0

    def __len__(self) -> int:
        return len(self._people)

    def add(self, walker: WalkingPedestrian) -> None:
        """Let somebody come; one of the same name goes."""
        self._people[walker.name] = Pedestrian.of(walker)
        self._people = dict(sorted(self._people.items()))

    def remove(self, name: str) -> bool:
        """Let somebody go; says whether they were there."""
        return self._people.pop(name, None) is not None

    def poses(self) -> dict[str, Pose2]:
        """Where everybody is."""
        return {name: person.pose for name, person in self._people.items()}

    def radius(self, name: str) -> float:
        """Return the body radius of a pedestrian in m."""
        return self._people[name].who.radius

    def top_speed(self, name: str) -> float:
        """Return the maximum walking speed of a pedestrian in m/s."""
        who = self._people[name].who
        return max(forces.MOST_OF_SPEED * who.speed, THREATENING_SPEED)

    def step(self, around: Surroundings, seconds: float) -> list[PedestrianAction]:
        """Let time pass, during which everybody walks in a straight line; says what they did."""
        people = list(self._people.values())
        if not people:
            return []
        reacting, deeds = self._reactions(people, around, seconds)
        for number, person in enumerate(people):
            self._plan(person, number)
        wishes = [person.wish(robot) for person, robot in zip(people, reacting, strict=True)]
        places = np.array([person.place for person in people])
        velocities = np.array([person.velocity for person in people])
        walls = self._walls.near(places)
        pushed = self._pushes(people, reacting, wishes, places, velocities, around, walls)
        moves, after = _relaxed(wishes, places, velocities, pushed, seconds)
        allowed = clip_moves(moves, self._limits(people, places, around, walls))
        cut = (allowed != moves).any(axis=1)
        after[cut] = allowed[cut] / seconds
        for person, by, velocity, wish in zip(people, allowed, after, wishes, strict=True):
            person.move(by, velocity, wish.looks_at, seconds)
            deeds += person.arrive()
        self._steps += 1
        return deeds

    def _reactions(
        self, people: list[Pedestrian], around: Surroundings, seconds: float
    ) -> tuple[list[ObservedRobot | None], list[PedestrianAction]]:
        """Return the robot that each pedestrian reacts to, and their actions."""
        reacting: list[ObservedRobot | None] = []
        deeds: list[PedestrianAction] = []
        for person in people:
            visible: dict[str, ObservedRobot] = {}
            if person.who.reacts_within and "robots" not in person.who.blind_to:
                visible = {robot.name: robot for robot in around.robots if self._in_view(person, robot)}
                deeds += person.take(visible, seconds)
            reacting.append(None if person.reacts_to is None else visible.get(person.reacts_to))
        return reacting, deeds

    def _in_view(self, person: Pedestrian, robot: ObservedRobot) -> bool:
        return bool(self._walls.visible(np.array([person.place]), np.array([robot.pose[:2]]))[0])

    def _plan(self, person: Pedestrian, number: int) -> None:
        """Plan a path to the goal: for a new goal, or if the next corner is out of view after a push."""
        goal = person.destination
        stale = person.planned_for != goal
        if not stale and person.way and (self._steps + number) % PATIENCE == 0:
            stale = not self._walls.visible(np.array([person.place]), np.array([person.way[0]]))[0]
        if stale:
            person.way, person.planned_for = self._find_way(person.place, goal, person.who.radius), goal

    def _pushes(
        self,
        people: list[Pedestrian],
        reacting: list[ObservedRobot | None],
        wishes: list[Intent],
        places: Array,
        velocities: Array,
        around: Surroundings,
        walls: Near,
    ) -> Array:
        """Return the external forces (n, 2) on all pedestrians, without their own driving force."""
        force = self._social(people, reacting, places, velocities, around)
        force += self._obstacles(people, places, around, walls)
        for members in _groups(people):
            force[members] += forces.group(places[members], velocities[members])
        for number, (person, robot, wish) in enumerate(zip(people, reacting, wishes, strict=True)):
            if wish.still:
                force[number] = 0.0
            elif robot is not None and person.who.behavior == "scared":
                away = places[number] - np.array(robot.pose[:2])
                distance = max(math.hypot(*away), 1e-6)
                force[number] += SCARED_FORCE / max(distance - person.who.radius, 0.1) * away / distance
        return force

    def _social(
        self,
        people: list[Pedestrian],
        reacting: list[ObservedRobot | None],
        places: Array,
        velocities: Array,
        around: Surroundings,
    ) -> Array:
        others = _others(people, places, velocities, around)
        towards = others.places[np.newaxis] - places[:, np.newaxis]
        near = np.hypot(towards[..., 0], towards[..., 1]) <= VIEW
        np.fill_diagonal(near, False)
        near &= _minded(people, reacting, around)
        one, other = np.nonzero(near)
        force = forces.social(towards[one, other], velocities[one] - others.velocities[other], others.wider[other])
        felt = np.hypot(force[:, 0], force[:, 1]) > UNFELT
        one, other, force = one[felt], other[felt], force[felt]
        seen = self._walls.visible(places[one], others.places[other])
        return _summed(one[seen], force[seen], len(people))

    def _obstacles(self, people: list[Pedestrian], places: Array, around: Surroundings, walls: Near) -> Array:
        """Of walls, things, and the robot for whom it is but a thing: the nearest place of each."""
        who, owner, nearest = walls
        first = _first_of_each(who, owner, np.hypot(*(nearest - places[who]).T))
        found = [(who[first], nearest[first])]
        for thing in around.things:
            seeing = np.array([k for k, person in enumerate(people) if "objects" not in person.who.blind_to], np.int64)
            found.append(_nearest_of(seeing, places, edges(thing.outlines)))
        for robot in around.robots:
            impassive = np.array([k for k, p in enumerate(people) if p.who.behavior == "impassive"
                                  and "robots" not in p.who.blind_to], np.int64)  # fmt: skip
            found.append(_nearest_of(impassive, places, edges([robot.pose.apply(robot.outline)])))
        who = np.concatenate([some for some, _ in found])
        away = places[who] - np.concatenate([where for _, where in found])
        distance = np.maximum(np.hypot(away[:, 0], away[:, 1]), 1e-9)
        radii = np.array([person.who.radius for person in people])
        force = forces.wall(away / distance[:, np.newaxis], distance - radii[who])
        return _summed(who, force, len(people))

    def _limits(self, people: list[Pedestrian], places: Array, around: Surroundings, walls: Near) -> list[MoveLimits]:
        radii = np.array([person.who.radius for person in people])
        who, _, nearest = walls
        every = [_keep_off(who, nearest, places, radii, 1.0)]
        for blind, outlines in [
            *(("objects", thing.outlines) for thing in around.things),
            *(("robots", (robot.pose.apply(robot.outline),)) for robot in around.robots),
        ]:
            seeing = np.array([k for k, person in enumerate(people) if blind not in person.who.blind_to], np.int64)
            some, where = _nearest_of(seeing, places, edges(outlines), each=True)
            every.append(_keep_off(some, where, places, radii, 0.5))
        apart = places[np.newaxis] - places[:, np.newaxis]
        distance = np.hypot(apart[..., 0], apart[..., 1])
        one, other = np.nonzero((distance < 2 * REACH) & ~np.eye(len(people), dtype=np.bool_))
        length = np.maximum(distance[one, other], 1e-9)
        unit = apart[one, other] / length[:, np.newaxis]
        return [*every, move_limits(one, unit, length - radii[one] - radii[other], 0.5)]


def _others(people: list[Pedestrian], places: Array, velocities: Array, around: Surroundings) -> _Others:
    robots = around.robots
    return _Others(
        np.concatenate((places, np.array([robot.pose[:2] for robot in robots]).reshape(-1, 2))),
        np.concatenate((velocities, np.array([robot.velocity for robot in robots]).reshape(-1, 2))),
        np.array([*(p.who.radius - OWN_WIDTH for p in people), *(robot.radius - OWN_WIDTH for robot in robots)]),
    )


def _minded(people: list[Pedestrian], reacting: list[ObservedRobot | None], around: Surroundings) -> Flags:
    """Whether each person (rows) minds each other and each robot (columns) as a person."""
    minds = np.ones((len(people), len(people) + len(around.robots)), dtype=np.bool_)
    for number, (person, reacts_to) in enumerate(zip(people, reacting, strict=True)):
        if "people" in person.who.blind_to:
            minds[number, : len(people)] = False
        if "robots" in person.who.blind_to or person.who.behavior == "impassive":
            minds[number, len(people) :] = False
        elif reacts_to is not None:
            minds[number, len(people) :] &= np.array([robot.name != reacts_to.name for robot in around.robots])
    return minds


def _groups(people: list[Pedestrian]) -> list[Numbers]:
    """Those who walk together: whoever reacts to a robot leaves the group for that long."""
    names = sorted({person.who.group for person in people if person.who.group is not None})
    found = [[k for k, p in enumerate(people) if p.who.group == name and p.reacts_to is None] for name in names]
    return [np.array(members) for members in found if len(members) > 1]


def _relaxed(
    wishes: list[Intent], places: Array, velocities: Array, pushed: Array, seconds: float
) -> tuple[Array, Array]:
    """Return moves and velocities under constant forces: dv/dt = (wished - v) / τ + pushed, solved exactly."""
    wished = np.zeros_like(places)
    for number, wish in enumerate(wishes):
        if wish.target is not None:
            away = np.array(wish.target) - places[number]
            distance = math.hypot(*away)
            wished[number] = wish.speed * away / distance if distance > 0 else 0.0
    steady = wished + RELAXATION_TIME * pushed
    fading = math.exp(-seconds / RELAXATION_TIME)
    most = np.array([wish.most for wish in wishes])
    after = _capped(steady + (velocities - steady) * fading, most)
    moves = steady * seconds + (velocities - steady) * RELAXATION_TIME * (1 - fading)
    standing = (np.hypot(*steady.T) < CREEP) & (np.hypot(*velocities.T) < CREEP)
    moves[standing] = after[standing] = 0.0
    return _capped(moves, most * seconds), after


def _capped(vectors: Array, most: Array) -> Array:
    length = np.hypot(vectors[:, 0], vectors[:, 1])
    capped: Array = vectors * np.minimum(1.0, most / np.maximum(length, 1e-12))[:, np.newaxis]
    return capped


def _summed(who: Numbers, force: Array, count: int) -> Array:
    """Return the sum of forces (n, 2) for each of `count`, added in order, so that rounding is reproducible."""
    sums = [np.bincount(who, force[:, axis], minlength=count) for axis in (0, 1)]
    return np.stack(sums, axis=1).astype(np.float64)  # of nobody it counts in whole numbers


def _first_of_each(who: Numbers, owner: Numbers, distance: Array) -> Numbers:
    """Return the index of the nearest entry for each pair of a pedestrian and an owner."""
    order = np.lexsort((distance, owner, who))
    pairs = np.stack((who[order], owner[order]), axis=1)
    fresh = np.ones(len(order), dtype=np.bool_)
    fresh[1:] = (pairs[1:] != pairs[:-1]).any(axis=1)
    first: Numbers = order[fresh]
    return first


def _nearest_of(who: Numbers, places: Array, sides: Array, each: bool = False) -> tuple[Numbers, Array]:
    """Return the nearest point of an outline, or of `each` of its sides, for pedestrians within REACH."""
    some = np.repeat(who, len(sides))
    where = nearest_on(np.tile(sides, (len(who), 1, 1)), places[some])
    distance = np.hypot(*(where - places[some]).T)
    near = np.flatnonzero(distance <= REACH)
    if not each:
        near = near[_first_of_each(some[near], np.zeros_like(near), distance[near])]
    return some[near], where[near]


def _keep_off(who: Numbers, where: Array, places: Array, radii: Array, share: float) -> MoveLimits:
    towards = where - places[who]
    distance = np.maximum(np.hypot(towards[:, 0], towards[:, 1]), 1e-9)
    return move_limits(who, towards / distance[:, np.newaxis], distance - radii[who], share)
