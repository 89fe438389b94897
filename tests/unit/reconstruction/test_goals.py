import pytest
import synthetic_drives as drives

from simscen.core.geometry import Pose2
from simscen.reconstruction.drive.recorded_drive import RecordedGoal
from simscen.reconstruction.scenario.contents import passing_radius


def test_the_passing_radius_is_the_distance_at_which_goals_were_passed_rounded_up():
    drive = drives.drive()
    x, y, _ = drive.poses.values[-1].tolist()
    near = RecordedGoal("a", Pose2(x + 0.48, y), 0.0, float(drive.poses.times[-1]), "passed")
    nearer = RecordedGoal("b", Pose2(x + 0.3, y), 0.0, float(drive.poses.times[-1]), "passed")
    assert passing_radius(drives.drive(goals=(near, nearer))) == pytest.approx(0.5)


def test_a_robot_that_stops_at_each_goal_has_no_passing_radius():
    assert passing_radius(drives.drive()) is None
