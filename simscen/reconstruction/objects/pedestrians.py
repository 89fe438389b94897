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
MIN_BODY_RADIUS_M, MAX_BODY_RADIUS_M = 0.2, 0.35
"""Minimum and maximum radius of a pedestrian."""
LEGS_BODY_RADIUS_M = 0.25
"""Radius of a pedestrian whose legs the lidar saw."""
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
MAX_STANDING_SPEED_M_S, MIN_STOP_S = 0.2, 1.5
"""Speed below which a person stands, and minimum duration of a stop that can be a reaction to the robot."""
TRIED_TOLERANCES_M = (math.inf, 0.6, 0.3)
"""Maximum distances to try between a track and the straight lines from goal to goal. With inf, there is one goal."""
MEETING_DISTANCE_M, SURPRISE_DISTANCE_M = 3.0, 4.0
"""Maximum distances from the robot at which a person evades the robot, and at which a person stops to look at it."""
MIN_RMSE_DECREASE_M = 0.05
"""Minimum decrease of the RMSE for which a more complex pedestrian is preferred."""
GOOD_RMSE_M, HOPELESS_RMSE_M = 0.12, 0.6
"""RMSE below which the search for goals and reactions ends, and RMSE above which the fit is rejected."""
MAX_TRACK_DISTANCE_M = 1.2
"""Distance between a simulated pedestrian and the track above which the simulation ends."""
TRIED_SPEED_FACTORS = (0.93, 1.07)
"""Multiples of the measured speed to try."""


@dataclass(frozen=True)
class _Reaction:
    """Possible reaction of a person to the robot.

    behavior:  `behavior` of the pedestrian
    duration:  time in s for which the person stops to look at the robot; 0 for other behaviors
    blind_to:  kinds of obstacles that the person does not evade
    """

    behavior: Behavior = "regular"
    duration: float = 0.0
    blind_to: frozenset[Ignorable] = frozenset()


def fit_pedestrians(objects: Sequence[FoundObject], trial: PedestrianTrial) -> list[FoundObject]:
    """Return the objects, with a pedestrian and a name such as "person 1" for each object that a pedestrian fits.

    Each pedestrian is first fitted alone. Then all pedestrians are simulated together, and the worst one is removed
    until the errors of all pedestrians are small enough.
    """
    people = [thing for thing in objects if is_person(thing)]
    if len(people) > MAX_PEOPLE:
        return [*objects]
    others = [thing for thing in objects if thing not in people]
    pedestrians = {
        thing.name: _fit_pedestrian(thing, [person for person in people if person is not thing], others, trial)
        for thing in people
    }
    fitted = [replace(thing, pedestrian=pedestrians.get(thing.name)) for thing in objects]
    while any(thing.pedestrian for thing in fitted):
        fitted = _simulate_together(fitted, trial)
        worst = max(fitted, key=_relative_error)
        if _relative_error(worst) <= 1.0:
            break
        fitted = [replace(thing, pedestrian=None) if thing is worst else thing for thing in fitted]
    return [*_with_person_names(fitted)]


def _with_person_names(objects: Sequence[FoundObject]) -> Iterator[FoundObject]:
    """Yield the objects. Objects with a pedestrian are named "person 1", "person 2", …"""
    count = 0
    for thing in objects:
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
    """Motion of an object, sampled every STEP_S.

    Attributes:
        times: Times (n,) in s.
        positions: Positions (n, 2) in m in the map frame.
        speeds: Speeds (n,) in m/s.
    """

    def __init__(self, thing: FoundObject) -> None:
        begin, end = thing.keyframes[0][0], thing.keyframes[-1][0]
        self.times: Array = np.append(np.arange(begin, end, STEP_S), end)
        self.positions: Array = thing.poses_at(self.times)[:, :2]
        indices = np.arange(len(self.times))
        after = np.minimum(indices + SMOOTHING_STEPS, len(indices) - 1)
        before = np.maximum(indices - SMOOTHING_STEPS, 0)
        distances = np.hypot(*(self.positions[after] - self.positions[before]).T)
        self.speeds: Array = distances / np.maximum(self.times[after] - self.times[before], 1e-6)

    @property
    def length(self) -> float:
        """Length in m."""
        return float(np.hypot(*np.diff(self.positions, axis=0).T).sum())

    @property
    def speed(self) -> float:
        """Median speed in m/s while the object moves."""
        walking_speeds = self.speeds[self.speeds > MAX_STANDING_SPEED_M_S]
        return float(np.median(walking_speeds)) if len(walking_speeds) else 0.0

    def position_at(self, time: float) -> tuple[float, float]:
        """Return the position (x, y) in m at a time in s."""
        x, y = (float(np.interp(time, self.times, self.positions[:, axis])) for axis in (0, 1))
        return x, y


def _fit_pedestrian(
    thing: FoundObject, people: Sequence[FoundObject], objects: Sequence[FoundObject], trial: PedestrianTrial
) -> FittedPedestrian | None:
    """Return the simplest pedestrian that fits the person `thing`; None if no pedestrian fits.

    All other `people` and `objects` move as recorded.
    """
    track = _Track(thing)
    distances = trial.robot_distances(track.times, track.positions)
    meets_robot = bool(distances.min() < MEETING_DISTANCE_M)

    def is_lost(time: float, position: tuple[float, float]) -> bool:
        return time > track.times[0] and math.dist(position, track.position_at(time)) > MAX_TRACK_DISTANCE_M

    def simulate(appear_time: float, walker: WalkingPedestrian) -> FittedPedestrian:
        paths = trial.simulate([(appear_time, walker)], people, objects, float(track.times[-1]), is_lost)
        return _with_errors(track, appear_time, walker, *paths[walker.name])

    best: FittedPedestrian | None = None
    for reaction in _reactions(track, distances, meets_robot):
        if best is not None and best.rmse < GOOD_RMSE_M:
            break
        for appear_time, walker in _walkers(thing, track, reaction, trial):
            best = _better(best, simulate(appear_time, walker), MIN_RMSE_DECREASE_M)
            if best.rmse < GOOD_RMSE_M:
                break
    if best is None or best.rmse > HOPELESS_RMSE_M:
        return None
    for factor in TRIED_SPEED_FACTORS:
        walker = replace(best.walker, speed=round(factor * track.speed, 2))
        best = _better(best, simulate(best.appear_time, walker), MIN_RMSE_DECREASE_M / 2)
    return replace(best, meets_robot=meets_robot)


def _better(current: FittedPedestrian | None, other: FittedPedestrian, margin: float) -> FittedPedestrian:
    """Return `other` if its RMSE is smaller by more than `margin` m, otherwise `current`."""
    return other if current is None or other.rmse < current.rmse - margin else current


def _reactions(track: _Track, distances: Array, meets_robot: bool) -> Iterator[_Reaction]:
    """Yield possible reactions to the robot, the simplest first. `distances` (n,) to the robot are in m."""
    yield _Reaction()
    if meets_robot:
        yield _Reaction(blind_to=frozenset({"robots"}))
    for stop in find_windows(track.speeds < MAX_STANDING_SPEED_M_S, track.times, MIN_STOP_S):
        walks_before_and_after = stop.first > 0 and stop.last < len(track.times) - 1
        if walks_before_and_after and distances[stop.first] < SURPRISE_DISTANCE_M:
            yield _Reaction("surprised", round(stop.length, 1))
            return


def _walkers(
    thing: FoundObject, track: _Track, reaction: _Reaction, trial: PedestrianTrial
) -> Iterator[tuple[float, WalkingPedestrian]]:
    """Yield pairs for a track: the time in s at which a pedestrian appears, and a possible pedestrian.

    Pedestrians with few goals are first. Pedestrians start at rest. If the track begins in motion, the pedestrian
    appears earlier by the relaxation time.
    """
    radius, walls = body_radius(thing), trial.world.walls
    lead_time = RELAXATION_TIME_S if track.speeds[0] > MAX_STANDING_SPEED_M_S else 0.0
    appear_time = round(max(0.0, float(track.times[0]) - lead_time), 2)
    x, y = track.position_at(appear_time + lead_time)
    tried_goals: set[tuple[tuple[float, float], ...]] = set()
    for tolerance in TRIED_TOLERANCES_M:
        corners = [*track.positions[path_corners(track.positions, tolerance)], _last_goal(track, radius, trial)]
        goals = tuple((round(float(a), 2), round(float(b), 2)) for a, b in corners)
        if goals in tried_goals or any(walls.distance(point) < radius + 0.01 for point in ((x, y), *goals)):
            continue
        tried_goals.add(goals)
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
        yield appear_time, walker


def body_radius(thing: FoundObject) -> float:
    """Return the radius in m of the pedestrian that replaces an object."""
    if not thing.is_cylinder:
        return LEGS_BODY_RADIUS_M
    return min(max(thing.size[0], MIN_BODY_RADIUS_M), MAX_BODY_RADIUS_M)


def _last_goal(track: _Track, radius: float, trial: PedestrianTrial) -> Array:
    """Return the last goal (2,) of the pedestrian for a track: the end of the track, or a point behind the end.

    If the track ends in motion, the goal is behind the end, because pedestrians brake before a goal.
    """
    end: Array = track.positions[-1]
    motion = end - track.position_at(float(track.times[-1]) - SMOOTHING_STEPS * STEP_S)
    distance = float(np.hypot(*motion))
    if distance < MAX_STANDING_SPEED_M_S * SMOOTHING_STEPS * STEP_S:
        return end
    farther: Array = end + motion / distance * track.speed * RELAXATION_TIME_S
    walls = trial.world.walls
    has_room = walls.distance((float(farther[0]), float(farther[1]))) >= radius + 0.01
    return farther if has_room and walls.visible(end[None], farther[None])[0] else end


def _simulate_together(objects: Sequence[FoundObject], trial: PedestrianTrial) -> list[FoundObject]:
    """Return the objects, with the positions and errors of their pedestrians in one simulation of all pedestrians."""
    walkers = [(thing.pedestrian.appear_time, thing.pedestrian.walker) for thing in objects if thing.pedestrian]
    others = [thing for thing in objects if not thing.pedestrian]
    end = max(thing.keyframes[-1][0] for thing in objects if thing.pedestrian)
    paths = trial.simulate(walkers, [], others, end)
    simulated = []
    for thing in objects:
        pedestrian = thing.pedestrian
        if pedestrian is not None:
            fitted = _with_errors(_Track(thing), pedestrian.appear_time, pedestrian.walker, *paths[thing.name])
            pedestrian = replace(fitted, meets_robot=pedestrian.meets_robot)
        simulated.append(replace(thing, pedestrian=pedestrian))
    return simulated


def _with_errors(
    track: _Track, appear_time: float, walker: WalkingPedestrian, times: Array, positions: Array
) -> FittedPedestrian:
    """Return the pedestrian `walker` with the errors of the simulated `positions` (n, 2) at `times` (n,)."""

    def rmse(shift: float) -> float:
        simulated = np.column_stack([np.interp(track.times + shift, times, positions[:, axis]) for axis in (0, 1)])
        return float(np.sqrt(np.mean(np.sum((simulated - track.positions) ** 2, axis=1))))

    errors = [(rmse(shift), abs(shift)) for shift in TRIED_SHIFTS_S.tolist()]
    return FittedPedestrian(appear_time, walker, times, positions, rmse(0.0), min(errors)[1])
