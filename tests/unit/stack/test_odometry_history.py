"""Tests of the history of odometry poses: lookup, interpolation, and refused readings."""

import pytest

from simscen.core.geometry import Pose2
from simscen.stack.odometry_history import HISTORY_S, OdometryHistory

TICK_RATE_HZ = 10


def history(*readings: tuple[int, Pose2]) -> OdometryHistory:
    odometry = OdometryHistory(TICK_RATE_HZ)
    for tick, pose in readings:
        odometry.add(tick, pose)
    return odometry


def straight_drive(*ticks: int) -> OdometryHistory:
    """Return the history of a robot that drives 0.1 m along x each tick, with readings at `ticks`."""
    return history(*((tick, Pose2(0.1 * tick, 0.0, 0.0)) for tick in ticks))


def test_latest_pose_until_a_tick_is_the_newest_or_else_the_first_pose() -> None:
    odometry = straight_drive(0, 6, 12)
    assert [odometry.latest_until(tick).x for tick in (-5, 0, 5, 6, 11, 12, 99)] == pytest.approx(
        [0, 0, 0, 0.6, 0.6, 1.2, 1.2]
    )


def test_pose_between_readings_is_interpolated_across_pi() -> None:
    odometry = history((10, Pose2(1, 1, 3.0)), (20, Pose2(2, 1, -3.0)))
    assert odometry.at(10) == Pose2(1, 1, 3.0)
    assert odometry.at(20) == Pose2(2, 1, -3.0)
    assert odometry.at(15) == pytest.approx((1.5, 1, 3.14159265))


def test_no_interpolation_outside_the_readings() -> None:
    odometry = straight_drive(10, 20)
    assert odometry.at(9) is None
    assert odometry.at(21) is None
    assert odometry.reaches(20)
    assert not odometry.reaches(21)


def test_past_pose_is_relative_to_the_given_current_pose() -> None:
    past = straight_drive(0, 6, 12).past_pose(Pose2(5.0, 5.0, 1.5707963267948966), 6)
    assert past == pytest.approx((5.0, 4.4, 1.5707963267948966))


def test_pose_before_any_reading_is_the_origin() -> None:
    odometry = history()
    assert not odometry.has_pose
    assert odometry.latest_until(5) == odometry.latest_pose == Pose2(0.0, 0.0)
    assert odometry.past_pose(Pose2(1, 2, 0.3), 5) == pytest.approx(Pose2(1, 2, 0.3))
    assert odometry.at(0) is None
    assert not odometry.reaches(0)


def test_readings_older_than_the_tf_buffer_are_dropped() -> None:
    odometry = straight_drive(*range(0, 1000, 10))
    oldest = 990 - HISTORY_S * TICK_RATE_HZ
    assert odometry.at(oldest - 1) is None
    assert odometry.at(oldest + 1) == pytest.approx((0.1 * (oldest + 1), 0, 0))
    assert odometry.latest_until(0).x == pytest.approx(0.1 * oldest)


@pytest.mark.parametrize("tick", [10, 5])
def test_reading_that_is_not_newer_is_refused(tick: int) -> None:
    odometry = history((10, Pose2(1, 1, 0)))
    assert not odometry.add(tick, Pose2(9, 9, 9))
    assert odometry.latest_pose == odometry.latest_until(99) == Pose2(1, 1, 0)


@pytest.mark.parametrize("value", [float("nan"), float("inf"), -float("inf"), 1e200])
@pytest.mark.parametrize("index", [0, 1, 2])
def test_reading_with_an_invalid_number_is_refused(value: float, index: int) -> None:
    odometry = history((10, Pose2(1, 1, 0)))
    assert not odometry.add(20, Pose2(*(value if index == k else 0.0 for k in range(3))))


def test_trail_is_kept_longer_than_the_lookup_buffer_and_can_be_cleared() -> None:
    odometry = OdometryHistory(TICK_RATE_HZ, trail_s=60)
    for tick in range(0, 1000, 10):
        odometry.add(tick, Pose2(0.1 * tick, 0.0, 0.0))
    assert 990 - 61 * TICK_RATE_HZ <= odometry.trail()[0].x / 0.1 <= 990 - 60 * TICK_RATE_HZ
    assert odometry.trail()[-1] == odometry.latest_pose
    assert odometry.at(990 - HISTORY_S * TICK_RATE_HZ - 1) is None
    odometry.clear()
    assert not odometry.trail()
    assert odometry.add(5, Pose2(1.0, 0.0, 0.0))
