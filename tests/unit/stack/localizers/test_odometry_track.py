"""Odometry can be asked for at any recent tick."""

import pytest

from simscen.core.geometry import Pose2
from simscen.core.motion import Twist
from simscen.core.sensing import Odometry
from simscen.stack.localizers.odometry_track import OdometryTrack


def track(*readings: tuple[int, Pose2], span: int = 100) -> OdometryTrack:
    result = OdometryTrack(span)
    for tick, pose in readings:
        result.add(Odometry("odom", tick, pose, Twist()))
    return result


def test_between_two_readings_it_is_interpolated_across_the_cut_of_the_circle() -> None:
    both = track((10, Pose2(1, 1, 3.0)), (20, Pose2(2, 1, -3.0)))
    assert both.at(10) == Pose2(1, 1, 3.0)
    assert both.at(20) == Pose2(2, 1, -3.0)
    assert both.at(15) == pytest.approx((1.5, 1, 3.14159265))


def test_outside_of_the_readings_there_is_no_answer() -> None:
    both = track((10, Pose2(1, 1, 0)), (20, Pose2(2, 1, 0)))
    assert both.at(9) is None
    assert both.at(21) is None
    assert both.reaches(20)
    assert not both.reaches(21)
    assert OdometryTrack(10).at(0) is None


def test_what_is_older_than_the_span_is_forgotten() -> None:
    long = track(*((tick, Pose2(tick, 0, 0)) for tick in range(0, 1000, 10)), span=100)
    assert long.at(880) is None
    assert long.at(891) == pytest.approx((891, 0, 0))


@pytest.mark.parametrize("tick", [10, 5])
def test_a_reading_that_is_not_newer_is_refused(tick: int) -> None:
    given = track((10, Pose2(1, 1, 0)))
    assert not given.add(Odometry("odom", tick, Pose2(9, 9, 9), Twist()))
    assert given.newest == Pose2(1, 1, 0)


@pytest.mark.parametrize("bad", [float("nan"), float("inf"), -float("inf"), 1e200])
@pytest.mark.parametrize("part", [0, 1, 2])
def test_a_reading_that_is_not_a_place_is_refused(bad: float, part: int) -> None:
    given = track((10, Pose2(1, 1, 0)))
    pose = Pose2(*(bad if part == k else 0.0 for k in range(3)))
    assert not given.add(Odometry("odom", 20, pose, Twist()))
