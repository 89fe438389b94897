"""Tests of Thinning and Throttle, which reduce the rate of recorded data."""

from simscen.core.geometry import Pose2, Pose3
from simscen.core.geometry.kinematics import STOP, Twist
from simscen.core.messages.sensor_data import Odometry
from simscen.core.records.trace import Truth
from simscen.record.trace_thinning import Thinning, Throttle


def test_a_command_is_kept_when_it_changes() -> None:
    thinning = Thinning(240)
    assert [thinning.keeps_command(t, Twist(v)) for t, v in enumerate([0.0, 0.0, 1.0, 1.0, 0.0])] == [1, 0, 1, 0, 1]


def test_an_unchanged_command_is_kept_twenty_times_a_second() -> None:
    thinning = Thinning(240)
    assert sum(thinning.keeps_command(tick, STOP) for tick in range(240)) == 20


def test_only_odometry_of_the_first_sensor_is_kept() -> None:
    thinning = Thinning(240)
    readings = [Odometry(name, 0, Pose2(0, 0), STOP) for name in ("wheels", "visual", "wheels")]
    assert [thinning.keeps_odometry(reading) for reading in readings] == [True, False, True]


def test_stationary_objects_are_kept_once_a_second() -> None:
    thinning = Thinning(240)
    kept_objects = [
        thinning.objects_to_keep(tick, Truth(Pose3(), STOP, 1.0, {"box": Pose3()})) for tick in range(0, 480, 6)
    ]
    assert sum(map(len, kept_objects)) == 2


def test_each_stationary_object_is_kept_one_second_after_its_last_sample() -> None:
    thinning, box, both = Thinning(240), {"box": Pose3()}, {"box": Pose3(), "cart": Pose3()}
    samples = [(0, box), *((tick, both) for tick in range(6, 600, 6))]
    kept_names = {
        tick: set(thinning.objects_to_keep(tick, Truth(Pose3(), STOP, 1.0, objects))) for tick, objects in samples
    }
    expected = {0: {"box"}, 6: {"cart"}, 240: {"box"}, 246: {"cart"}, 480: {"box"}, 486: {"cart"}}
    assert {tick: names for tick, names in kept_names.items() if names} == expected


def test_moving_objects_are_always_kept() -> None:
    thinning = Thinning(240)
    for tick in range(5):
        pose = Pose3(x=float(tick))
        assert thinning.objects_to_keep(tick, Truth(Pose3(), STOP, 1.0, {"cart": pose})) == {"cart": pose}


def test_throttle_passes_the_first_message_and_then_its_rate() -> None:
    throttle = Throttle(240, 2)
    assert [tick for tick in range(5, 500) if throttle.passes(tick)] == [5, 125, 245, 365, 485]
