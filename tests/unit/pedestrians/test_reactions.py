"""Tests of reactions of pedestrians to robots, as in HuNavSim."""

import math

import numpy as np
import pytest

from simscen.pedestrians.surroundings import ObservedObject, Surroundings
from tests.unit.pedestrians.rig import STEP, people, robot, walk, walker, walls

SURPRISED = {"behavior": "surprised", "reacts_within": 4.0, "reacts_for": 30.0}
CURIOUS = {"behavior": "curious", "reacts_within": 10.0, "reacts_for": 30.0}
SCARED = {"behavior": "scared", "reacts_within": 3.0, "reacts_for": 40.0}
THREATENING = {"behavior": "threatening", "reacts_within": 4.0, "reacts_for": 40.0}


def gaps(track: np.ndarray, x: float = 0.0, y: float = 0.0) -> np.ndarray:
    return np.hypot(track[:, 0] - x, track[:, 1] - y)


def test_regular_pedestrians_treat_the_robot_as_a_person():
    one = walk(people(walker("anna", 6.0, 0.0, (-9.0, 0.0))), 8.0, robot(-6.0, 0.0, 0.0, 1.0))[0]["anna"]
    passing = int(np.argmin(np.abs(one[:, 0] - (-6.0 + np.arange(len(one)) * STEP))))
    assert one[passing, 1] > 0.25, "it is passed on the right"


def test_impassive_pedestrians_treat_the_robot_as_an_object():
    """They continue until the wall force acts, and do not evade before."""
    one = walk(people(walker("anna", 6.0, 0.1, (-9.0, 0.1), behavior="impassive")), 3.0, robot(0.0, 0.0))[0]["anna"]
    before = one[one[:, 0] > 1.2]
    assert len(before) > 10 and before[:, 1] == pytest.approx(0.1, abs=1e-3)
    gap = np.hypot(*np.maximum(np.abs(one[:, :2]) - 0.2, 0.0).T) - 0.25
    assert gap.min() > 0.0


def test_surprised_pedestrians_stop_and_look_for_a_limited_time():
    crowd = people(walker("anna", 8.0, 1.0, (-9.0, 1.0), **SURPRISED))
    tracks, events = walk(crowd, 45.0, robot(0.0, 0.0))
    assert [(event.kind, event.goal_or_robot) for event in events] == [
        ("reacted", ""),
        ("calmed", ""),
        ("reached", "1"),
    ]
    anna = tracks["anna"]
    begun = int(np.argmax(gaps(anna) <= 4.0))
    standing = slice(begun + 80, begun + int(29.0 / STEP))
    assert np.ptp(anna[standing, :2], axis=0).max() < 0.01
    assert gaps(anna)[standing].min() > 4.0 - 1.3 * 0.54 - 0.1
    bearing = math.atan2(-anna[begun + 100, 1], -anna[begun + 100, 0])
    assert anna[begun + 100, 2] == pytest.approx(bearing, abs=1e-6)


def test_curious_pedestrians_approach_and_leave():
    crowd = people(walker("anna", 7.0, 3.0, (7.0, -9.0), yaw=math.pi, **CURIOUS))
    tracks, events = walk(crowd, 45.0, robot(0.0, 0.0))
    assert [event.kind for event in events] == ["reacted", "calmed", "reached"]
    near = gaps(tracks["anna"])
    assert 1.1 < near.min() <= 1.5
    assert near[600] < 1.6 and gaps(tracks["anna"], 7.0, -9.0)[-1] < 0.4


def test_scared_pedestrians_keep_away_from_a_standing_robot():
    """Their goal is behind the robot; the tolerance is their stopping distance."""
    crowd = people(walker("anna", 9.0, 0.0, (-9.0, 0.0), **SCARED))
    tracks, events = walk(crowd, 60.0, robot(0.0, 0.0))
    assert events[0].kind == "reacted" and gaps(tracks["anna"]).min() > 2.2


def test_scared_pedestrians_flee_from_a_slow_robot():
    crowd = people(walker("anna", 4.0, 0.0, (4.0, 0.0), yaw=math.pi, **SCARED))
    tracks, _ = walk(crowd, 20.0, robot(0.0, 0.0, 0.0, 0.4))
    away = tracks["anna"][:, 0] - np.arange(len(tracks["anna"])) * STEP * 0.4
    assert away.min() > 1.5 and tracks["anna"][-1, 0] > 9.0


def test_threatening_pedestrians_block_the_robot():
    crowd = people(walker("anna", 1.0, 3.0, (1.0, -9.0), **THREATENING))
    tracks, events = walk(crowd, 20.0, robot(0.0, 0.0, 0.0, 0.2))
    ahead = tracks["anna"][:, 0] - np.arange(len(tracks["anna"])) * STEP * 0.2
    blocking = slice(100, 400)
    assert events[0].kind == "reacted"
    assert ahead[blocking] == pytest.approx(1.1, abs=0.25)
    assert np.abs(tracks["anna"][blocking, 1]).max() < 0.1


def test_pedestrians_without_view_of_the_robot_do_not_react():
    hidden = people(walker("anna", 2.0, 0.0, yaw=math.pi, **SURPRISED), around=walls([[1.0, -3.0], [1.0, 3.0]]))
    assert not walk(hidden, 2.0, robot(0.0, 0.0))[1]
    turned = people(walker("anna", 2.0, 0.0, **SURPRISED))
    assert not walk(turned, 2.0, robot(0.0, 0.0))[1]


def test_pedestrians_blind_to_robots_ignore_them():
    blind = frozenset({"robots"})
    crowd = people(walker("anna", 4.0, 0.0, (-9.0, 0.0), blind_to=blind, **SURPRISED))
    alone = people(walker("anna", 4.0, 0.0, (-9.0, 0.0)))
    assert (walk(crowd, 5.0, robot(0.0, 0.0))[0]["anna"] == walk(alone, 5.0)[0]["anna"]).all()


def test_pedestrians_do_not_walk_into_a_visible_robot():
    """Only the driving force pushes them toward the robot, with each behavior."""
    for behavior in ("regular", "impassive"):
        crowd = people(walker("anna", 3.0, 0.0, (-9.0, 0.0), speed=2.0, behavior=behavior))
        track = walk(crowd, 8.0, robot(0.0, 0.0, radius=0.4))[0]["anna"]
        assert (np.hypot(*np.maximum(np.abs(track[:, :2]) - 0.4, 0.0).T) >= 0.25 - 1e-9).all(), behavior


def test_pedestrians_avoid_all_robots_and_react_to_the_nearest():
    crowd = people(walker("anna", 0.0, 0.0, (0.0, 0.0), **SURPRISED))
    _, events = walk(crowd, 1.0, robot(3.0, 0.5, name="far"), robot(2.0, 0.5, name="near"))
    assert [event.goal_or_robot for event in events if event.kind == "reacted"] == ["near"]


def test_pedestrians_walk_around_objects():
    crowd = people(walker("anna", -4.0, 0.1, (9.0, 0.1)))
    crate = ObservedObject("crate", (np.array([(-0.3, -0.3), (0.3, -0.3), (0.3, 0.3), (-0.3, 0.3)]),))
    track = []
    for _ in range(200):
        crowd.step(Surroundings(objects=(crate,)), STEP)
        track.append(crowd.poses()["anna"][:2])
    gap = np.hypot(*np.maximum(np.abs(np.array(track)) - 0.3, 0.0).T) - 0.25
    assert gap.min() >= -1e-9


@pytest.mark.parametrize("offset", [0.0, 5000.0])
def test_a_wall_hides_only_what_is_behind_it_also_far_from_the_origin(offset):
    around = walls([[offset, offset], [offset + 4, offset]])
    viewer, beside, behind = (np.array([[offset + x, offset + y]]) for x, y in ((0.5, 0.6), (3.5, 0.6), (2.0, -1.0)))
    assert around.visible(viewer, beside).all()
    assert not around.visible(viewer, behind).any()
