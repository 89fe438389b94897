import math

import pytest

from simscen.core.geometry import Pose2
from simscen.core.shapes import MotionPath
from simscen.sim.motion_path import pose_at, top_speed

THERE = (Pose2(0, 0, 0), Pose2(2, 0, 0), Pose2(2, 1, math.pi / 2))


def test_a_path_taken_once_stays_at_its_end():
    path = MotionPath((0.0, 2.0, 3.0), THERE, "once", start=1.0)
    assert pose_at(path, 0.5) == Pose2(0, 0, 0)
    assert pose_at(path, 2.0) == Pose2(1, 0, 0)
    assert pose_at(path, 3.5) == pytest.approx(Pose2(2, 0.5, math.pi / 4))
    assert pose_at(path, 99.0) == THERE[-1]


def test_a_loop_starts_over():
    path = MotionPath((0.0, 2.0, 3.0), THERE, "loop")
    assert pose_at(path, 3.0 + 1.0) == pytest.approx(Pose2(1, 0, 0))


def test_back_and_forth_returns_the_way_it_came():
    path = MotionPath((0.0, 2.0, 3.0), THERE, "back_and_forth")
    assert pose_at(path, 3.0 + 1.0 + 0.5) == pytest.approx(pose_at(path, 1.5))
    assert pose_at(path, 6.0 + 1.0) == pytest.approx(pose_at(path, 1.0))


def test_headings_turn_the_shorter_way():
    path = MotionPath((0.0, 1.0), (Pose2(0, 0, 3.0), Pose2(0, 0, -3.0)))
    assert abs(pose_at(path, 0.5).yaw) == pytest.approx(math.pi)


def test_a_single_waypoint_is_where_it_is():
    assert pose_at(MotionPath((0.0,), (Pose2(1, 2, 3),), "loop"), 5.0) == Pose2(1, 2, 3)


def test_top_speed_is_that_of_the_fastest_part():
    path = MotionPath((0.0, 2.0, 3.0), THERE)
    assert top_speed(path) == pytest.approx(1.0)
    assert top_speed(path, reach=0.5) == pytest.approx(1.0 + 0.5 * math.pi / 2)


def test_a_loop_that_does_not_close_jumps():
    assert top_speed(MotionPath((0.0, 2.0), THERE[:2], "loop")) == math.inf
    closed = MotionPath((0.0, 1.0, 2.0), (Pose2(0, 0, 0), Pose2(1, 0, 0), Pose2(0, 0, 0)), "loop")
    assert top_speed(closed) == pytest.approx(1.0)
