"""Tests of the goals of a recorded drive: goals from motion, names, and the passing radius."""

import numpy as np
import pytest
import synthetic_drives as drives

from simscen.core.geometry import Pose2
from simscen.reconstruction.drive.goals import goals_from_motion
from simscen.reconstruction.drive.recorded_drive import RecordedGoal
from simscen.reconstruction.scenario.contents import EstimatedParts, GivenParts, passing_radius, scenario_contents


def test_the_passing_radius_is_the_largest_distance_to_passed_goals_rounded_up():
    drive = drives.drive()
    x, y, _ = drive.poses.values[-1].tolist()
    farther = RecordedGoal("a", Pose2(x + 0.48, y), 0.0, float(drive.poses.times[-1]), "passed")
    closer = RecordedGoal("b", Pose2(x + 0.3, y), 0.0, float(drive.poses.times[-1]), "passed")
    assert passing_radius(drives.drive(goals=(farther, closer))) == pytest.approx(0.5)


def test_repeated_stamps_do_not_change_the_goals():
    poses = drives.drive().poses
    repeated = drives.signal(np.repeat(poses.times, 3), np.repeat(poses.values, 3, axis=0))
    assert list(goals_from_motion(repeated)) == list(goals_from_motion(poses))
    assert len(list(goals_from_motion(drives.signal(np.array([0.0, 0.001]), poses.values[[0, -1]])))) == 1


def test_names_of_goals_are_unique():
    goals = [RecordedGoal(name, Pose2(1.0, 3.0), 0.0, 1.0, "reached") for name in ("a-3", "a", "a", "a#2")]
    given_parts = GivenParts("w.world.yaml", "", "turtlebot", 1)
    contents = scenario_contents(drives.drive(goals=tuple(goals)), given_parts, EstimatedParts(()), "a", "a.mcap")
    assert len({goal.name for goal in contents.goals}) == 4


def test_a_robot_that_stops_at_each_goal_has_no_passing_radius():
    assert passing_radius(drives.drive()) is None
