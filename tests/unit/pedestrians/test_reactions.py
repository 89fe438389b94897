"""Tests of reactions of pedestrians to robots, as in HuNavSim."""

import math

import numpy as np
import pytest

from simscen.pedestrians.surroundings import ObservedObject, Surroundings
from tests.unit.pedestrians.crowds import STEP_S, make_crowd, robot, walk, walker, walls

SURPRISED = {"behavior": "surprised", "reacts_within": 4.0, "reacts_for": 30.0}
CURIOUS = {"behavior": "curious", "reacts_within": 10.0, "reacts_for": 30.0}
SCARED = {"behavior": "scared", "reacts_within": 3.0, "reacts_for": 40.0}
THREATENING = {"behavior": "threatening", "reacts_within": 4.0, "reacts_for": 40.0}


def distances_to(track: np.ndarray, x: float = 0.0, y: float = 0.0) -> np.ndarray:
    """Return the distance of each pose of the track to a point."""
    return np.hypot(track[:, 0] - x, track[:, 1] - y)


def test_regular_pedestrians_treat_the_robot_as_a_person():
    track = walk(make_crowd(walker("anna", 6.0, 0.0, (-9.0, 0.0))), 8.0, robot(-6.0, 0.0, 0.0, 1.0))[0]["anna"]
    passing = int(np.argmin(np.abs(track[:, 0] - (-6.0 + np.arange(len(track)) * STEP_S))))
    assert track[passing, 1] > 0.25, "the pedestrian passes the robot on the right"


def test_impassive_pedestrians_treat_the_robot_as_an_object():
    """They walk straight until the wall force acts."""
    track = walk(make_crowd(walker("anna", 6.0, 0.1, (-9.0, 0.1), behavior="impassive")), 3.0, robot(0.0, 0.0))[0][
        "anna"
    ]
    approach = track[track[:, 0] > 1.2]
    assert len(approach) > 10 and approach[:, 1] == pytest.approx(0.1, abs=1e-3)
    gap = np.hypot(*np.maximum(np.abs(track[:, :2]) - 0.2, 0.0).T) - 0.25
    assert gap.min() > 0.0


def test_surprised_pedestrians_stop_and_look_for_a_limited_time():
    crowd = make_crowd(walker("anna", 8.0, 1.0, (-9.0, 1.0), **SURPRISED))
    tracks, events = walk(crowd, 45.0, robot(0.0, 0.0))
    assert [(event.kind, event.goal_or_robot) for event in events] == [
        ("reacted", ""),
        ("calmed", ""),
        ("reached", "1"),
    ]
    anna = tracks["anna"]
    reaction = int(np.argmax(distances_to(anna) <= 4.0))
    standing = slice(reaction + 80, reaction + int(29.0 / STEP_S))
    assert np.ptp(anna[standing, :2], axis=0).max() < 0.01
    assert distances_to(anna)[standing].min() > 4.0 - 1.3 * 0.54 - 0.1
    bearing = math.atan2(-anna[reaction + 100, 1], -anna[reaction + 100, 0])
    assert anna[reaction + 100, 2] == pytest.approx(bearing, abs=1e-6)


def test_curious_pedestrians_approach_and_leave():
    crowd = make_crowd(walker("anna", 7.0, 3.0, (7.0, -9.0), yaw=math.pi, **CURIOUS))
    tracks, events = walk(crowd, 45.0, robot(0.0, 0.0))
    assert [event.kind for event in events] == ["reacted", "calmed", "reached"]
    distances = distances_to(tracks["anna"])
    assert 1.1 < distances.min() <= 1.5
    assert distances[600] < 1.6 and distances_to(tracks["anna"], 7.0, -9.0)[-1] < 0.4


def test_scared_pedestrians_keep_away_from_a_standing_robot():
    """Their goal is behind the robot. They react at 3 m and come at most 0.8 m closer while they stop."""
    crowd = make_crowd(walker("anna", 9.0, 0.0, (-9.0, 0.0), **SCARED))
    tracks, events = walk(crowd, 60.0, robot(0.0, 0.0))
    assert events[0].kind == "reacted" and distances_to(tracks["anna"]).min() > 2.2


def test_scared_pedestrians_flee_from_a_slow_robot():
    crowd = make_crowd(walker("anna", 4.0, 0.0, (4.0, 0.0), yaw=math.pi, **SCARED))
    tracks, _ = walk(crowd, 20.0, robot(0.0, 0.0, 0.0, 0.4))
    gap = tracks["anna"][:, 0] - np.arange(len(tracks["anna"])) * STEP_S * 0.4
    assert gap.min() > 1.5 and tracks["anna"][-1, 0] > 9.0


def test_threatening_pedestrians_block_the_robot():
    crowd = make_crowd(walker("anna", 1.0, 3.0, (1.0, -9.0), **THREATENING))
    tracks, events = walk(crowd, 20.0, robot(0.0, 0.0, 0.0, 0.2))
    gap = tracks["anna"][:, 0] - np.arange(len(tracks["anna"])) * STEP_S * 0.2
    blocking = slice(100, 400)
    assert events[0].kind == "reacted"
    assert gap[blocking] == pytest.approx(1.1, abs=0.25)
    assert np.abs(tracks["anna"][blocking, 1]).max() < 0.1


def test_pedestrians_without_view_of_the_robot_do_not_react():
    occluded = make_crowd(walker("anna", 2.0, 0.0, yaw=math.pi, **SURPRISED), wall_map=walls([[1.0, -3.0], [1.0, 3.0]]))
    assert not walk(occluded, 2.0, robot(0.0, 0.0))[1]
    facing_away = make_crowd(walker("anna", 2.0, 0.0, **SURPRISED))
    assert not walk(facing_away, 2.0, robot(0.0, 0.0))[1]


def test_pedestrians_blind_to_robots_ignore_them():
    blind_to = frozenset({"robots"})
    crowd = make_crowd(walker("anna", 4.0, 0.0, (-9.0, 0.0), blind_to=blind_to, **SURPRISED))
    alone = make_crowd(walker("anna", 4.0, 0.0, (-9.0, 0.0)))
    assert (walk(crowd, 5.0, robot(0.0, 0.0))[0]["anna"] == walk(alone, 5.0)[0]["anna"]).all()


def test_pedestrians_do_not_walk_into_a_visible_robot():
    """Neither behavior lets the driving force push a pedestrian into the robot."""
    for behavior in ("regular", "impassive"):
        crowd = make_crowd(walker("anna", 3.0, 0.0, (-9.0, 0.0), speed=2.0, behavior=behavior))
        track = walk(crowd, 8.0, robot(0.0, 0.0, radius=0.4))[0]["anna"]
        assert (np.hypot(*np.maximum(np.abs(track[:, :2]) - 0.4, 0.0).T) >= 0.25 - 1e-9).all(), behavior


def test_pedestrians_react_to_the_nearest_of_several_robots():
    crowd = make_crowd(walker("anna", 0.0, 0.0, (0.0, 0.0), **SURPRISED))
    _, events = walk(crowd, 1.0, robot(3.0, 0.5, name="far"), robot(2.0, 0.5, name="near"))
    assert [event.goal_or_robot for event in events if event.kind == "reacted"] == ["near"]


def test_pedestrians_walk_around_objects():
    crowd = make_crowd(walker("anna", -4.0, 0.1, (9.0, 0.1)))
    crate = ObservedObject("crate", (np.array([(-0.3, -0.3), (0.3, -0.3), (0.3, 0.3), (-0.3, 0.3)]),))
    track = []
    for _ in range(200):
        crowd.step(Surroundings(objects=(crate,)), STEP_S)
        track.append(crowd.poses()["anna"][:2])
    gap = np.hypot(*np.maximum(np.abs(np.array(track)) - 0.3, 0.0).T) - 0.25
    assert gap.min() >= -1e-9


@pytest.mark.parametrize("offset", [0.0, 5000.0])
def test_a_wall_hides_only_what_is_behind_it_also_far_from_the_origin(offset):
    wall_map = walls([[offset, offset], [offset + 4, offset]])
    viewer, beside, behind = (np.array([[offset + x, offset + y]]) for x, y in ((0.5, 0.6), (3.5, 0.6), (2.0, -1.0)))
    assert wall_map.visible(viewer, beside).all()
    assert not wall_map.visible(viewer, behind).any()
