import pytest

from simscen.core.geometry import Pose2
from simscen.stack.odometry_history import KEPT, OdometryHistory


def history(*ticks: int) -> OdometryHistory:
    """A robot that drives 0.1 m along x each tick."""
    kept = OdometryHistory()
    for tick in ticks:
        kept.add(tick, Pose2(0.1 * tick, 0.0, 0.0))
    return kept


def test_the_pose_at_a_tick_is_the_newest_up_to_then() -> None:
    kept = history(0, 6, 12)
    assert [kept.at(tick).x for tick in (-5, 0, 5, 6, 11, 12, 99)] == pytest.approx([0, 0, 0, 0.6, 0.6, 1.2, 1.2])


def test_where_the_robot_was_is_told_in_the_frame_in_which_it_is_told_where_it_is() -> None:
    before = history(0, 6, 12).then(Pose2(5.0, 5.0, 1.5707963267948966), 6)
    assert before == pytest.approx((5.0, 4.4, 1.5707963267948966))


def test_readings_out_of_order_are_passed_over_and_old_ones_forgotten() -> None:
    kept = history(0, 12, 6)
    assert kept.now.x == pytest.approx(1.2)
    many = history(*range(10 * KEPT))
    assert many.at(0).x > 0.0
    assert many.at(10 * KEPT - KEPT).x == pytest.approx(0.1 * (10 * KEPT - KEPT))


def test_before_any_reading_it_is_at_the_origin() -> None:
    assert OdometryHistory().at(5) == Pose2(0.0, 0.0)
    assert OdometryHistory().then(Pose2(1, 2, 0.3), 5) == pytest.approx(Pose2(1, 2, 0.3))
