"""Tests of the incidents that are found in a recorded drive, and of the criteria that are proposed for it."""

from dataclasses import replace

import numpy as np
import pytest
import synthetic_drives as drives

from simscen.core.geometry import Pose2
from simscen.reconstruction.drive.goals import STOP_SOURCE
from simscen.reconstruction.drive.recorded_drive import RecordedGoal, no_values
from simscen.reconstruction.scenario.criteria import propose_criteria
from simscen.reconstruction.scenario.incidents import find_incidents, longest_stay

REACHED = RecordedGoal("shelf", Pose2(7.0, 3.0), 0.0, 11.5, "reached", source="/goal_pose")


def drive(**changes):
    return replace(drives.drive(), goals=(REACHED,), **changes)


def kinds(recorded):
    return [incident.kind for incident in find_incidents(recorded)]


def limits(recorded, invalid_goals=False):
    """Return the limits of the proposed criteria by kind."""
    return {
        criterion.kind: dict(criterion.values)
        for criterion in propose_criteria(recorded, find_incidents(recorded), (), invalid_goals)
    }


def test_a_drive_that_reaches_its_goal_has_no_incident():
    assert kinds(drive()) == []


def test_a_pressed_bumper_is_a_contact_at_its_time_and_place():
    times = np.arange(0.0, drives.DURATION_S, 0.05)
    (contact,) = find_incidents(drive(bumper=drives.signal(times, (times > 4.0) & (times < 4.3))))
    assert (contact.kind, contact.criterion) == ("contact", "collisions")
    assert contact.time == pytest.approx(4.05, abs=0.06)
    assert contact.position == pytest.approx(tuple(drives.poses(np.array([4.05]))[0, :2]), abs=0.05)


def test_a_belief_far_from_the_truth_is_lost():
    plain = drive()
    values = plain.belief.values.copy()
    values[plain.belief.times > 6.0, 0] += 1.0
    assert kinds(replace(plain, belief=drives.signal(plain.belief.times, values))) == ["lost"]


def test_without_a_ground_truth_an_uncertain_belief_is_lost():
    plain = drive(has_true_poses=False)
    values = plain.belief.values.copy()
    values[plain.belief.times > 6.0, 3] = 4.0
    assert kinds(replace(plain, belief=drives.signal(plain.belief.times, values))) == ["lost"]


def test_a_robot_that_stays_in_place_with_a_goal_is_stuck():
    times = np.arange(0.0, 30.0, 0.1)
    poses = np.tile([1.0, 3.0, 0.0], (len(times), 1))
    goal = replace(REACHED, end_time=None, status="unknown")
    recorded = replace(drives.drive(), duration=30.0, poses=drives.signal(times, poses), goals=(goal,))
    assert "stuck" in kinds(recorded) and "unfinished goal" in kinds(recorded)


@pytest.mark.parametrize(("speed", "expected"), [(0.0, []), (0.3, ["stuck"])])
def test_a_parked_robot_whose_goal_is_its_stop_is_not_stuck(speed, expected):
    times = np.arange(0.0, 30.0, 0.1)
    poses = np.tile([1.0, 3.0, 0.0], (len(times), 1))
    commands = drives.signal(times, np.column_stack((np.full(len(times), speed), np.zeros((len(times), 2)))))
    goal = replace(REACHED, end_time=30.0, source=STOP_SOURCE)
    recorded = replace(
        drives.drive(), duration=30.0, poses=drives.signal(times, poses), goals=(goal,), commands=commands
    )
    assert [kind for kind in kinds(recorded) if kind == "stuck"] == expected


def test_a_failed_goal_is_an_incident_with_its_code():
    failed = replace(REACHED, status="failed", error="NO_VALID_PATH")
    (incident,) = find_incidents(replace(drives.drive(), goals=(failed,)))
    assert (incident.kind, incident.criterion) == ("failed goal", "goals_reached")
    assert "NO_VALID_PATH" in incident.detail


def test_the_longest_stay_begins_where_the_robot_stops():
    times = np.arange(0.0, 20.0, 0.1)
    x = np.minimum(times, 8.0)
    begin, length = longest_stay(times, np.column_stack((x, np.zeros(len(x)))), 0.5)
    assert begin == pytest.approx(7.5, abs=0.3)
    assert length == pytest.approx(12.4, abs=0.4)


def test_limits_of_satisfied_criteria_have_a_margin():
    proposed = limits(drive())
    efficiency = ["time_to_goal", "path_length", "speed"]
    assert list(proposed) == ["goals_reached", "collisions", "localization_error", *efficiency]
    assert proposed["speed"] == {"max": "0.7 m/s"}
    assert proposed["time_to_goal"] == {"max": "14 s"}
    assert proposed["localization_error"] == {"max": 0.25}


@pytest.mark.parametrize("scale", [0.5, 2.0])
def test_limit_of_the_speed_is_from_the_ground_truth(scale):
    odometry = drives.drive().odometry
    assert limits(drive(odometry=replace(odometry, values=scale * odometry.values)))["speed"] == {"max": "0.7 m/s"}


def test_limit_of_the_speed_ignores_a_kidnapping():
    poses = drives.drive().poses.values.copy()
    poses[200:, 1] += 1.0
    moved = drive(poses=drives.signal(drives.drive().poses.times, poses))
    assert limits(moved)["speed"] == {"max": "0.7 m/s"}


def test_a_violated_criterion_has_the_limit_that_was_violated():
    times = np.arange(0.0, 30.0, 0.1)
    poses = np.tile([1.0, 3.0, 0.0], (len(times), 1))
    goal = replace(REACHED, end_time=None, status="unknown")
    recorded = replace(drives.drive(), duration=30.0, poses=drives.signal(times, poses), goals=(goal,))
    proposed = limits(recorded)
    assert proposed["stuck"] == {"max": "10 s"}
    assert "time_to_goal" not in proposed


def reasons(recorded):
    return {
        criterion.kind: criterion.reason.comment
        for criterion in propose_criteria(recorded, find_incidents(recorded), (), False)
    }


def test_reasons_of_criteria_do_not_claim_more_than_the_log_shows():
    canceled = replace(drives.drive(), goals=(replace(REACHED, status="canceled"),))
    assert reasons(canceled)["goals_reached"].startswith("the log does not show that all goals were reached")
    assert reasons(drive())["goals_reached"].startswith("held: all goals were reached")
    no_bumper = "the log does not show contacts, because it has no bumper"
    assert reasons(drive(bumper=no_values(1)))["collisions"].startswith(no_bumper)
    times = np.arange(0.0, drives.DURATION_S, 0.05)
    never_pressed = drives.signal(times, np.zeros(len(times)))
    assert reasons(drive(bumper=never_pressed))["collisions"].startswith("held: no contact")
