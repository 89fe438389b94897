"""Tests of pedestrians that reproduce the moving objects of a recorded drive."""

import math

import numpy as np
import pytest
import synthetic_drives as drives

from simscen.reconstruction.objects.found_object import FoundObject
from simscen.reconstruction.objects.pedestrian_trial import PedestrianTrial
from simscen.reconstruction.objects.pedestrians import fit_pedestrians, is_person
from simscen.reconstruction.reasons import Reason
from simscen.reconstruction.scenario.scenario_text import _object_lines
from simscen.run.live_world.pedestrians import PedestrianMap
from tests.scenario_files import spec_of_text


def moving_object(path, size=(0.25,), name="moving object 1", begin=1.0, end=9.0):
    """Return a found object whose position at a time in s is `path(time)`."""
    times = np.arange(begin, end, 0.2)
    frames = tuple((time, *path(time), 0.0) for time in times.tolist())
    return FoundObject(name, size, frames, None, None, Reason("seen"))


def fit(*objects):
    return fit_pedestrians(objects, PedestrianTrial(drives.drive(), PedestrianMap(drives.room().built), 0.2))


def test_a_person_who_walks_straight_far_from_the_robot_becomes_a_pedestrian():
    (person,) = fit(moving_object(lambda time: (9.0, 0.6 + 0.6 * (time - 1.0))))
    assert person.name == person.pedestrian.walker.name == "person 1"
    assert person.pedestrian.rmse < 0.15 and person.pedestrian.time_shift <= 0.2
    assert person.pedestrian.walker.speed == pytest.approx(0.6, abs=0.06)
    assert len(person.pedestrian.walker.goals) == 1
    assert math.dist(person.pedestrian.walker.goals[0], (9.0, 5.3)) < 0.4
    assert not person.pedestrian.meets_robot


def test_a_corner_of_the_path_becomes_a_goal():
    def path(time):
        distance = 0.8 * (time - 1.0)
        return (9.3 - min(distance, 3.0), 5.3 - max(0.0, distance - 3.0))

    (person,) = fit(moving_object(path))
    assert person.pedestrian is not None and person.pedestrian.rmse < 0.3
    assert len(person.pedestrian.walker.goals) == 2
    assert math.dist(person.pedestrian.walker.goals[0], (6.3, 5.3)) < 0.3


def test_a_person_who_walks_through_the_place_of_the_robot_does_not_evade_it():
    x, y, _ = drives.poses(np.array([6.0]))[0].tolist()
    (person,) = fit(moving_object(lambda time: (x + 0.45, y + 0.8 * (time - 5.6)), begin=3.0))
    assert person.pedestrian.meets_robot
    assert person.pedestrian.walker.blind_to == {"robots"}


def test_a_track_that_no_pedestrian_walks_stays_scripted():
    (person,) = fit(moving_object(lambda time: (8.5, 3.0 + 1.5 * math.sin(1.2 * time))))
    assert person.pedestrian is None
    assert person.name == "moving object 1"


@pytest.mark.parametrize("size", [(0.9, 0.6), (0.05,), (0.5,)])
def test_an_object_without_the_size_of_a_person_stays_scripted(size):
    assert not is_person(moving_object(lambda time: (9.0, 0.6 + 0.6 * time), size))


def test_an_object_faster_than_people_walk_stays_scripted():
    assert not is_person(moving_object(lambda time: (9.0, 0.6 + 2.5 * (time - 1.0)), end=2.8))


def test_the_written_pedestrian_can_be_read_again():
    (person,) = fit(moving_object(lambda time: (9.0, 0.6 + 0.6 * (time - 1.0))))
    events = "\n".join(_object_lines(person))
    scenario_keys = "simscen: 1\nworld: room.world.yaml\nrobot: {pose: {x: 0, y: 0}}\nevents:\n"
    text = f"{scenario_keys}{events}\npass:\n  - collisions: {{max: 0}}\n"
    pedestrian = spec_of_text(text, "scenario.yaml").events[0].do.pedestrian
    assert pedestrian.name == "person 1"
    assert pedestrian.speed == person.pedestrian.walker.speed
    assert [tuple(goal) for goal in pedestrian.goals] == list(person.pedestrian.walker.goals)
