import pytest

from simscen.core.geometry import Pose2
from simscen.stack.odometry_history import HISTORY_S, OdometryHistory

RATE = 10


def history(*readings: tuple[int, Pose2]) -> OdometryHistory:
    kept = OdometryHistory(RATE)
    for tick, pose in readings:
        kept.add(tick, pose)
    return kept


def straight(*ticks: int) -> OdometryHistory:
    """A robot that drives 0.1 m along x each tick."""
    return history(*((tick, Pose2(0.1 * tick, 0.0, 0.0)) for tick in ticks))


def test_held_pose_at_a_tick_is_the_newest_before_it() -> None:
    kept = straight(0, 6, 12)
    assert [kept.latest_until(tick).x for tick in (-5, 0, 5, 6, 11, 12, 99)] == pytest.approx(
        [0, 0, 0, 0.6, 0.6, 1.2, 1.2]
    )


def test_pose_between_readings_is_interpolated_across_pi() -> None:
    both = history((10, Pose2(1, 1, 3.0)), (20, Pose2(2, 1, -3.0)))
    assert both.at(10) == Pose2(1, 1, 3.0)
    assert both.at(20) == Pose2(2, 1, -3.0)
    assert both.at(15) == pytest.approx((1.5, 1, 3.14159265))


def test_no_interpolation_outside_the_readings() -> None:
    both = straight(10, 20)
    assert both.at(9) is None
    assert both.at(21) is None
    assert both.reaches(20)
    assert not both.reaches(21)


def test_past_poses_are_in_the_current_frame() -> None:
    before = straight(0, 6, 12).past_pose(Pose2(5.0, 5.0, 1.5707963267948966), 6)
    assert before == pytest.approx((5.0, 4.4, 1.5707963267948966))


def test_pose_before_any_reading_is_the_origin() -> None:
    nothing = history()
    assert not nothing.has_pose
    assert nothing.latest_until(5) == nothing.latest_pose == Pose2(0.0, 0.0)
    assert nothing.past_pose(Pose2(1, 2, 0.3), 5) == pytest.approx(Pose2(1, 2, 0.3))
    assert nothing.at(0) is None
    assert not nothing.reaches(0)


def test_readings_older_than_the_tf_buffer_are_dropped() -> None:
    long = straight(*range(0, 1000, 10))
    oldest = 990 - HISTORY_S * RATE
    assert long.at(oldest - 1) is None
    assert long.at(oldest + 1) == pytest.approx((0.1 * (oldest + 1), 0, 0))
    assert long.latest_until(0).x == pytest.approx(0.1 * oldest)


@pytest.mark.parametrize("tick", [10, 5])
def test_a_reading_that_is_not_newer_is_refused(tick: int) -> None:
    given = history((10, Pose2(1, 1, 0)))
    assert not given.add(tick, Pose2(9, 9, 9))
    assert given.latest_pose == given.latest_until(99) == Pose2(1, 1, 0)


@pytest.mark.parametrize("bad", [float("nan"), float("inf"), -float("inf"), 1e200])
@pytest.mark.parametrize("part", [0, 1, 2])
def test_a_reading_that_is_not_a_place_is_refused(bad: float, part: int) -> None:
    given = history((10, Pose2(1, 1, 0)))
    assert not given.add(20, Pose2(*(bad if part == k else 0.0 for k in range(3))))


def test_path_is_longer_than_the_lookup_buffer_and_restarts_with_new_odometry() -> None:
    kept = OdometryHistory(RATE, trail_s=60)
    for tick in range(0, 1000, 10):
        kept.add(tick, Pose2(0.1 * tick, 0.0, 0.0))
    assert 990 - 61 * RATE <= kept.trail()[0].x / 0.1 <= 990 - 60 * RATE
    assert kept.trail()[-1] == kept.latest_pose
    assert kept.at(990 - HISTORY_S * RATE - 1) is None
    kept.clear()
    assert not kept.trail()
    assert kept.add(5, Pose2(1.0, 0.0, 0.0))
