"""Tests of faults that corrupt the content of messages."""

import numpy as np
import pytest
from fault_effects import image, imu, odometry, scan, start, unsuitable_key

VALUES = {"nan": np.nan, "inf": np.inf, "zero": 0.0, "negative": -1.0, "huge": 1e30}


@pytest.mark.parametrize("name", VALUES)
def test_garbage_has_the_given_value_in_each_message_type(name):
    spec, value = {"garbage": {"value": name}}, VALUES[name]
    np.testing.assert_array_equal(start(spec, "Scan").reading(scan([1.0, 2.0])).ranges, [value] * 2)
    np.testing.assert_array_equal(start(spec, "Odometry").reading(odometry()).pose, [value] * 3)
    np.testing.assert_array_equal(start(spec, "Imu").reading(imu()).linear_acceleration, [value] * 3)
    np.testing.assert_array_equal(start(spec, "Image").reading(image([[1.0]])).depth, [[np.float32(value)]])


def test_message_can_be_truncated_or_empty():
    assert start({"garbage": {"value": "empty"}}, "Scan").reading(scan([1.0] * 9)).ranges.tolist() == []
    assert start({"garbage": {"value": "short"}}, "Scan").reading(scan([1.0] * 9)).ranges.tolist() == [1.0] * 4
    assert start({"garbage": {"value": "short"}}, "Image").reading(image(np.ones((6, 4)))).rgb.shape == (3, 4, 3)
    assert unsuitable_key({"garbage": {"value": "short"}}, "Odometry")[0] == "value"


def test_garbage_has_the_given_share_and_other_messages_are_unchanged():
    effect, message = start({"garbage": {"probability": "30 %"}}, "Imu"), imu()
    outputs = [effect.reading(message) for _ in range(4000)]
    assert sum(output is not message for output in outputs) / 4000 == pytest.approx(0.3, abs=0.03)


def test_default_garbage_is_drawn_from_all_values():
    effect = start({"garbage": {}}, "Scan")
    sizes = [len(effect.reading(scan([1.0] * 8)).ranges) for _ in range(400)]
    assert {size: sizes.count(size) / 400 for size in (0, 4, 8)} == pytest.approx(
        {0: 1 / 7, 4: 1 / 7, 8: 5 / 7}, abs=0.06
    )
