"""Tests of faults that delay, drop, thin out, or freeze messages."""

import numpy as np
import pytest
from fault_effects import ManualClock, belief, image, imu, odometry, scan, start, unsuitable_key

from simscen.core.geometry import Pose2
from simscen.core.geometry.kinematics import Twist


def arrivals(fault: dict, ticks: int, period: int = 24, end_tick: int | None = None) -> list[tuple[int, int]]:
    """Return the tick of arrival and the tick of measurement of each scan; the fault ends at `end_tick`."""
    now = ManualClock()
    effect, arrived = start(fault, "Scan", now), []
    for now.tick in range(ticks):
        if now.tick == end_tick:
            effect = effect.end()
        arrived += [(now.tick, reading.tick) for reading in effect.arriving_readings()]
        if now.tick % period == 0 and (reading := effect.reading(scan([1.0], now.tick))) is not None:
            arrived.append((now.tick, reading.tick))
    return arrived


def test_fixed_delay_is_equal_for_every_message():
    assert arrivals({"delay": {"latency": "0.2 s"}}, 200) == [(48 + 24 * k, 24 * k) for k in range(7)]


def test_random_delay_keeps_the_order_of_messages():
    scans = arrivals({"delay": {"latency": "100 ms", "jitter": "1 s"}}, 24_000)
    assert [measured for _, measured in scans] == [24 * k for k in range(len(scans))]
    arrived = np.array([tick for tick, _ in scans])
    assert (np.diff(arrived) >= 0).all()
    delays = (arrived - np.array([measured for _, measured in scans])) / 240
    assert delays.min() >= 0.1 - 1 / 480
    assert delays.max() <= 1.1 + 1 / 480
    # A message waits for all earlier ones, so the mean delay is above that of the uniform distribution, 0.6 s.
    assert delays.mean() > 0.6


def test_rare_messages_have_a_uniform_delay():
    scans = arrivals({"delay": {"latency": "100 ms", "jitter": "1 s"}}, 480_000, period=480)
    delays = np.array([(arrived - measured) / 240 for arrived, measured in scans])
    assert np.quantile(delays, [0.25, 0.5, 0.75]) == pytest.approx([0.35, 0.6, 0.85], abs=0.05)


def test_delayed_messages_arrive_in_order_after_the_fault_ends():
    scans = arrivals({"delay": {"latency": "0.5 s"}}, 400, end_tick=60)
    assert scans == [(120, 0), (144, 24), (168, 48), (168, 72), (168, 96), (168, 120), (168, 144), (168, 168)] + [
        (24 * k, 24 * k) for k in range(8, 17)
    ]


def test_only_the_newest_delayed_command_is_used():
    now = ManualClock()
    effect = start({"delay": {"latency": "50 ms"}}, "Command", now)
    for now.tick in range(0, 12, 3):
        assert effect.command(Twist(now.tick)) is None
    now.tick = 21
    assert effect.arriving_command() == Twist(9)
    assert effect.arriving_command() is None


@pytest.mark.parametrize(("rate", "period"), [("5 Hz", 48), ("2 Hz", 120)])
def test_slow_sensor_has_the_given_rate(rate, period):
    assert [tick for tick, _ in arrivals({"slow": {"rate": rate}}, 1201)] == list(range(0, 1201, period))


def test_rate_that_does_not_divide_that_of_the_sensor_holds_on_average():
    ticks = [tick for tick, _ in arrivals({"slow": {"rate": "3 Hz"}}, 2400)]
    assert len(ticks) == 30
    assert set(np.diff(ticks)) == {72, 96}


def test_slow_rate_must_be_below_that_of_the_sensor():
    assert unsuitable_key({"slow": {"rate": 10}}, "Scan", rate=10.0)[0] == "rate"
    assert unsuitable_key({"slow": {"rate": 9}}, "Scan", rate=10.0) is None


def test_intermittent_fault_has_the_stated_share_and_burst_length():
    ticks = np.array(
        [tick for tick, _ in arrivals({"intermittent": {"up": "1 s", "down": "0.5 s"}}, 240_000, period=6)]
    )
    assert len(ticks) / 40_000 == pytest.approx(2 / 3, abs=0.03)
    gaps = np.diff(ticks)
    gaps = gaps[gaps > 6] / 240
    assert gaps.mean() == pytest.approx(0.5, rel=0.15)
    assert gaps.std() == pytest.approx(0.5, rel=0.2)
    assert ticks[0] > 0


@pytest.mark.parametrize(
    ("kind", "first", "later"),
    [
        ("Scan", scan([1.0, 2.0]), scan([3.0, 4.0], 24)),
        ("Odometry", odometry(Pose2(1, 2)), odometry(Pose2(3, 4), 24)),
        ("Imu", imu(), imu(24, (9, 9, 9))),
        ("Image", image([[1.0]]), image([[2.0]], 24)),
    ],
)
def test_stuck_sensor_repeats_its_first_message_with_new_stamps(kind, first, later):
    effect = start({"stuck": {}}, kind)
    assert effect.reading(first) is not None
    output = effect.reading(later)
    assert output.tick == 24
    name = {"Scan": "ranges", "Odometry": "pose", "Imu": "angular_velocity", "Image": "depth"}[kind]
    np.testing.assert_array_equal(getattr(output, name), getattr(first, name))


def test_stuck_command_is_repeated_and_stuck_wheels_do_not_turn():
    command, wheels = start({"stuck": {}}, "Command"), start({"stuck": {}}, "Wheels")
    assert [command.command(Twist(0.1 * k)) for k in range(1, 4)] == [Twist(0.1)] * 3
    assert [wheels.command(Twist(0.1 * k)) for k in range(1, 4)] == [Twist()] * 3


def test_disabled_localizer_leaves_only_odometry():
    effect = start({"off": {}}, "Belief")
    effect.belief(belief(Pose2(5, 5), Pose2(1, 0)))
    output = effect.belief(belief(Pose2(7, 6), Pose2(2, 0)))
    assert output.pose == pytest.approx((6, 5, 0))
    assert output.map_from_odom == pytest.approx((4, 5, 0))


def test_stuck_localizer_repeats_its_first_belief():
    effect, first = start({"stuck": {}}, "Belief"), belief(Pose2(5, 5), Pose2(1, 0))
    assert effect.belief(first) is first
    assert effect.belief(belief(Pose2(7, 6), Pose2(2, 0))) is first


def test_belief_jumps_in_the_robot_frame_and_keeps_the_offset_of_the_map():
    effect = start({"jump": {"x": 1, "yaw": "90 deg"}}, "Belief")
    output = effect.belief(belief(Pose2(2, 2, np.pi / 2), Pose2(0, 0)))
    assert output.pose == pytest.approx((2, 3, -np.pi), abs=1e-9) or output.pose == pytest.approx((2, 3, np.pi))
    after = effect.belief(belief(Pose2(2, 2.5, np.pi / 2), Pose2(0.5, 0)))
    assert (after.pose.x, after.pose.y) == pytest.approx((1.5, 3))
    assert after.map_from_odom.compose(Pose2(0.5, 0)) == pytest.approx(after.pose)


def corrections(fault: dict, ticks: int, end_tick: int | None = None) -> list[float]:
    """Return the x of map_from_odom at each tick, if map_from_odom and odometry both grow by 1 m per tick."""
    now = ManualClock()
    effect, received = start(fault, "Belief", now), []
    for now.tick in range(ticks):
        if now.tick == end_tick:
            effect = effect.end()
        output = effect.belief(belief(Pose2(2.0 * now.tick, 0), Pose2(now.tick, 0))) if effect else None
        if output:
            assert output.pose.x == pytest.approx(output.map_from_odom.x + now.tick)
        received.append(output.map_from_odom.x if output else now.tick)
    return received


def test_delayed_localizer_corrections_are_extrapolated_by_odometry():
    received = corrections({"delay": {"latency": "50 ms"}}, 60)
    assert received == pytest.approx([max(0, tick - 12) for tick in range(60)])
    ended = corrections({"delay": {"latency": "50 ms"}}, 60, end_tick=30)
    assert ended[:41] == pytest.approx(received[:41])
    assert ended[41:] == pytest.approx(list(range(41, 60)))


def test_last_correction_is_kept_until_the_next_one():
    assert corrections({"slow": {"rate": "10 Hz"}}, 60) == pytest.approx([24 * (tick // 24) for tick in range(60)])
    intermittent = corrections({"intermittent": {"up": "0.1 s", "down": "0.1 s"}}, 2400)
    assert all(intermittent[k] in (k, intermittent[k - 1]) for k in range(1, 2400))
    assert np.mean([intermittent[k] != k for k in range(2400)]) == pytest.approx(0.5, abs=0.15)
