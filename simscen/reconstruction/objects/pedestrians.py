"""Fits simulated pedestrians to the tracks of people."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from simscen.core.environment.world_model import Behavior, Ignorable, WalkingPedestrian
from simscen.core.geometry import Array, Pose2
from simscen.core.geometry.polylines import path_corners
from simscen.pedestrians.forces import RELAXATION_TIME_S
from simscen.reconstruction.objects.found_object import FittedPedestrian, FoundObject
from simscen.reconstruction.objects.pedestrian_trial import PedestrianTrial
from simscen.reconstruction.reasons import find_windows

MIN_CYLINDER_RADIUS_M, MAX_CYLINDER_RADIUS_M = 0.15, 0.4
"""Minimum and maximum radius of a round object that can be a person."""
MAX_LEGS_SIDE_M = 0.7
"""Maximum side of a box that can be the two legs of a person."""
MIN_BODY_RADIUS_M, MAX_BODY_RADIUS_M, LEGS_BODY_RADIUS_M = 0.2, 0.35, 0.25
"""Limits of the radius of a pedestrian, and radius of a pedestrian whose legs the lidar saw."""
MIN_WALK_M = 1.0
"""Minimum length of the track of a person."""
MAX_PEOPLE = 4
"""Maximum number of people for which pedestrians are fitted. Simulations of larger crowds diverge."""
MIN_WALKING_SPEED_M_S, MAX_WALKING_SPEED_M_S = 0.3, 2.2
"""Minimum and maximum median speed of a person who walks."""
MAX_RMSE_M, MAX_TIME_SHIFT_S = 0.3, 0.5
"""Maximum RMSE and time shift between the track and the simulation of an accepted pedestrian."""
TRIED_SHIFTS_S = np.round(np.arange(-1.0, 1.01, 0.05), 2)
"""Time shifts to try between a track and a simulated pedestrian."""
STEP_S, SMOOTHING_STEPS = 0.1, 5
"""Time between two positions of a track, and number of steps on each side over which the speed is averaged."""
MOVING_SPEED_M_S, MIN_STOP_S = 0.2, 1.5
"""Speed below which a person stands, and minimum duration of a stop that can be a reaction to the robot."""
PATH_TOLERANCES_M = (math.inf, 0.6, 0.3)
"""Maximum distances to try between a track and the straight lines from goal to goal; inf: only one goal."""
MEETING_DISTANCE_M, SURPRISE_DISTANCE_M = 3.0, 4.0
"""Distance from the robot within which a person evades the robot, or stops and looks at the robot."""
MIN_RMSE_DECREASE_M = 0.05
"""Minimum decrease of the RMSE for which a more complex pedestrian is preferred."""
GOOD_RMSE_M, HOPELESS_RMSE_M = 0.12, 0.6
"""RMSE below which the search for goals and reactions ends, and RMSE above which a person gets no pedestrian."""
LOST_M = 1.2
"""Maximum distance between a simulated pedestrian and the track. The simulation ends at a larger distance."""
SPEED_FACTORS = (0.93, 1.07)
"""Multiples of the measured speed to try."""


@dataclass(frozen=True)
class _Reaction:
    """Possible reaction of a person to the robot: behavior, duration in s, and kinds of obstacles that are ignored."""

    behavior: Behavior = "regular"
    duration: float = 0.0
    blind_to: frozenset[Ignorable] = frozenset()


def fit_pedestrians(objects: Sequence[FoundObject], trial: PedestrianTrial) -> list[FoundObject]:
    """Return the objects. An object to which a pedestrian fits gets this pedestrian and a name such as "person 1"."""
    people = [thing for thing in objects if is_person(thing)]
    if len(people) > MAX_PEOPLE:
        return [*objects]
    others = [thing for thing in objects if thing not in people]
    fitted = {
        thing.name: _fit_pedestrian(thing, [person for person in people if person is not thing], others, trial)
        for thing in people
    }
    found = [replace(thing, pedestrian=fitted.get(thing.name)) for thing in objects]
    while any(thing.pedestrian for thing in found):
        found = _simulated_together(found, trial)
        worst = max(found, key=_relative_error)
        if _relative_error(worst) <= 1.0:
            break
        found = [replace(thing, pedestrian=None) if thing is worst else thing for thing in found]
    return [*_with_person_names(found)]


def _with_person_names(found: Sequence[FoundObject]) -> Iterator[FoundObject]:
    """Yield the objects. Objects with a pedestrian are named "person 1", "person 2", …"""
    count = 0
    for thing in found:
        if thing.pedestrian is None:
            yield thing
        else:
            count += 1
            walker = replace(thing.pedestrian.walker, name=f"person {count}")
            yield replace(thing, name=walker.name, pedestrian=replace(thing.pedestrian, walker=walker))


def _relative_error(thing: FoundObject) -> float:
    """Return the error of an object's pedestrian as a multiple of the maximum error; 0 without a pedestrian."""
    pedestrian = thing.pedestrian
    return 0.0 if pedestrian is None else max(pedestrian.rmse / MAX_RMSE_M, pedestrian.time_shift / MAX_TIME_SHIFT_S)


def is_person(thing: FoundObject) -> bool:
    """Return whether the size, track length, and speed of an object fit a walking person."""
    if not thing.is_moving or thing.is_robot:
        return False
    if thing.is_cylinder:
        is_body = MIN_CYLINDER_RADIUS_M <= thing.size[0] <= MAX_CYLINDER_RADIUS_M
    else:
        is_body = max(thing.size) <= MAX_LEGS_SIDE_M
    track = _Track(thing)
    return is_body and track.length >= MIN_WALK_M and MIN_WALKING_SPEED_M_S <= track.speed <= MAX_WALKING_SPEED_M_S


class _Track:
    """Positions (n, 2) in m and speeds (n,) in m/s of an object, sampled every STEP_S."""

    def __init__(self, thing: FoundObject) -> None:
        begin, end = thing.keyframes[0][0], thing.keyframes[-1][0]
        self.times: Array = np.append(np.arange(begin, end, STEP_S), end)
        self.positions: Array = thing.poses_at(self.times)[:, :2]
        span = np.arange(len(self.times))
        after = np.minimum(span + SMOOTHING_STEPS, len(span) - 1)
        before = np.maximum(span - SMOOTHING_STEPS, 0)
        moved = np.hypot(*(self.positions[after] - self.positions[before]).T)
        self.speeds: Array = moved / np.maximum(self.times[after] - self.times[before], 1e-6)

    @property
    def length(self) -> float:
        """Length in m."""
        return float(np.hypot(*np.diff(self.positions, axis=0).T).sum())

    @property
    def speed(self) -> float:
        """Median speed in m/s while the object moves."""
        walking = self.speeds[self.speeds > MOVING_SPEED_M_S]
        return float(np.median(walking)) if len(walking) else 0.0

    def position_at(self, time: float) -> tuple[float, float]:
        """Return the position (x, y) in m at a time in s."""
        x, y = (float(np.interp(time, self.times, self.positions[:, axis])) for axis in (0, 1))
        return x, y


def _fit_pedestrian(
    thing: FoundObject, people: Sequence[FoundObject], objects: Sequence[FoundObject], trial: PedestrianTrial
) -> FittedPedestrian | None:
    """Return the simplest pedestrian that fits `thing` while all others move as recorded; None if none fits."""
    track = _Track(thing)
    distances = trial.robot_distances(track.times, track.positions)
    meets_robot = bool(distances.min() < MEETING_DISTANCE_M)

    def is_lost(time: float, position: tuple[float, float]) -> bool:
        return time > track.times[0] and math.dist(position, track.position_at(time)) > LOST_M

    def tried(begin: float, walker: WalkingPedestrian) -> FittedPedestrian:
        walked = trial.simulate([(begin, walker)], people, objects, float(track.times[-1]), is_lost)
        return _with_errors(track, begin, walker, *walked[walker.name])

    best: FittedPedestrian | None = None
    for reaction in _reactions(track, distances, meets_robot):
        if best is not None and best.rmse < GOOD_RMSE_M:
            break
        for begin, walker in _walkers(thing, track, reaction, trial):
            best = _better(best, tried(begin, walker), MIN_RMSE_DECREASE_M)
            if best.rmse < GOOD_RMSE_M:
                break
    if best is None or best.rmse > HOPELESS_RMSE_M:
        return None
    for factor in SPEED_FACTORS:
        faster = replace(best.walker, speed=round(factor * track.speed, 2))
        best = _better(best, tried(best.appear_time, faster), MIN_RMSE_DECREASE_M / 2)
    return replace(best, meets_robot=meets_robot)


def _better(simple: FittedPedestrian | None, other: FittedPedestrian, margin: float) -> FittedPedestrian:
    """Return `other` if its RMSE is smaller by more than `margin` m, otherwise `simple`."""
    return other if simple is None or other.rmse < simple.rmse - margin else simple


def _reactions(track: _Track, distances: Array, meets_robot: bool) -> Iterator[_Reaction]:
    """Yield possible reactions to the robot, the simplest first. `distances` (n,) to the robot are in m."""
    yield _Reaction()
    if meets_robot:
        yield _Reaction(blind_to=frozenset({"robots"}))
    for stop in find_windows(track.speeds < MOVING_SPEED_M_S, track.times, MIN_STOP_S):
        walks_before_and_after = stop.first > 0 and stop.last < len(track.times) - 1
        if walks_before_and_after and distances[stop.first] < SURPRISE_DISTANCE_M:
            yield _Reaction("surprised", round(stop.length, 1))
            return


def _walkers(
    thing: FoundObject, track: _Track, reaction: _Reaction, trial: PedestrianTrial
) -> Iterator[tuple[float, WalkingPedestrian]]:
    """Yield time of appearance in s and pedestrian for each possible walk along a track, walks with few goals first.

    Pedestrians start at rest. If the track begins in motion, they appear earlier by the relaxation time.
    """
    radius, walls = body_radius(thing), trial.world.walls
    lead = RELAXATION_TIME_S if track.speeds[0] > MOVING_SPEED_M_S else 0.0
    begin = round(max(0.0, float(track.times[0]) - lead), 2)
    x, y = track.position_at(begin + lead)
    tried: set[tuple[tuple[float, float], ...]] = set()
    for tolerance in PATH_TOLERANCES_M:
        places = [*track.positions[path_corners(track.positions, tolerance)], _last_goal(track, radius, trial)]
        goals = tuple((round(float(a), 2), round(float(b), 2)) for a, b in places)
        if goals in tried or any(walls.distance(place) < radius + 0.01 for place in ((x, y), *goals)):
            continue
        tried.add(goals)
        yaw = math.atan2(goals[0][1] - y, goals[0][0] - x)
        walker = WalkingPedestrian(
            name=thing.name,
            pose=Pose2(round(x, 3), round(y, 3), round(yaw, 2)),
            goals=goals,
            speed=round(track.speed, 2),
            radius=radius,
            behavior=reaction.behavior,
            blind_to=reaction.blind_to,
            reacts_within=SURPRISE_DISTANCE_M if reaction.behavior == "surprised" else 0.0,
            reacts_for=reaction.duration,
        )
        yield begin, walker


def body_radius(thing: FoundObject) -> float:
    """Return the radius in m of a pedestrian for an object."""
    if not thing.is_cylinder:
        return LEGS_BODY_RADIUS_M
    return min(max(thing.size[0], MIN_BODY_RADIUS_M), MAX_BODY_RADIUS_M)


def _last_goal(track: _Track, radius: float, trial: PedestrianTrial) -> Array:
    """Return the end (2,) of a track. If it ends in motion, return a point beyond: pedestrians brake before a goal."""
    end: Array = track.positions[-1]
    motion = end - track.position_at(float(track.times[-1]) - SMOOTHING_STEPS * STEP_S)
    distance = float(np.hypot(*motion))
    if distance < MOVING_SPEED_M_S * SMOOTHING_STEPS * STEP_S:
        return end
    farther: Array = end + motion / distance * track.speed * RELAXATION_TIME_S
    walls = trial.world.walls
    has_room = walls.distance((float(farther[0]), float(farther[1]))) >= radius + 0.01
    return farther if has_room and walls.visible(end[None], farther[None])[0] else end


def _simulated_together(found: Sequence[FoundObject], trial: PedestrianTrial) -> list[FoundObject]:
    """Return the objects with the positions and errors from one simulation of all pedestrians."""
    walkers = [(thing.pedestrian.appear_time, thing.pedestrian.walker) for thing in found if thing.pedestrian]
    objects = [thing for thing in found if not thing.pedestrian]
    end = max(thing.keyframes[-1][0] for thing in found if thing.pedestrian)
    paths = trial.simulate(walkers, [], objects, end)
    together = []
    for thing in found:
        pedestrian = thing.pedestrian
        if pedestrian is not None:
            again = _with_errors(_Track(thing), pedestrian.appear_time, pedestrian.walker, *paths[thing.name])
            pedestrian = replace(again, meets_robot=pedestrian.meets_robot)
        together.append(replace(thing, pedestrian=pedestrian))
    return together


def _with_errors(
    track: _Track, begin: float, walker: WalkingPedestrian, times: Array, positions: Array
) -> FittedPedestrian:
    """Return the pedestrian `walker` with the errors of the simulated `positions` (n, 2) at `times` (n,)."""

    def rmse(shift: float) -> float:
        at = np.column_stack([np.interp(track.times + shift, times, positions[:, axis]) for axis in (0, 1)])
        return float(np.sqrt(np.mean(np.sum((at - track.positions) ** 2, axis=1))))

    errors = [(rmse(shift), abs(shift)) for shift in TRIED_SHIFTS_S.tolist()]
    return FittedPedestrian(begin, walker, times, positions, rmse(0.0), min(errors)[1])
