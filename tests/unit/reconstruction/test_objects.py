"""Tests of the objects that are found in the scans of a recorded drive."""

import math

import numpy as np
import pytest
import synthetic_drives as drives

from simscen.reconstruction.objects.find_objects import find_objects


def found_objects(objects=None):
    """Return the objects that are found in scans of the room with the bodies that `objects` returns at a time in s."""
    return find_objects(drives.compared_scans(drives.scans(objects)), drives.room(), has_true_poses=True)


def rmse(found_object, truth):
    """Return the RMSE in m of the keyframes of an object."""
    frames = np.array(found_object.keyframes)
    times = np.arange(frames[0, 0], frames[-1, 0], 0.1)
    positions = np.column_stack([np.interp(times, frames[:, 0], frames[:, axis]) for axis in (1, 2)])
    true_positions = np.array([truth(time)[:2] for time in times.tolist()])
    return float(np.sqrt(np.mean(np.sum((positions - true_positions) ** 2, axis=1))))


def test_an_empty_room_has_no_object():
    assert found_objects() == []


def test_a_standing_box_is_found_with_its_size_and_pose():
    (found_object,) = found_objects(lambda time: [drives.body(4.5, 1.0, math.radians(30), (0.8, 0.4))])
    assert not found_object.is_moving
    assert found_object.appear_time is None and found_object.disappear_time is None
    _, x, y, yaw = found_object.keyframes[0]
    assert math.hypot(x - 4.5, y - 1.0) < 0.15
    turned = (yaw - math.radians(30)) % (math.pi / 2)
    assert min(turned, math.pi / 2 - turned) < math.radians(8)
    assert sorted(found_object.size) == pytest.approx([0.4, 0.8], abs=0.15)


def test_a_standing_column_is_a_cylinder():
    (found_object,) = found_objects(lambda time: [drives.body(5.0, 4.2, 0.0, (0.25,))])
    assert found_object.is_cylinder
    assert found_object.size[0] == pytest.approx(0.25, abs=0.04)
    assert math.dist(found_object.keyframes[0][1:3], (5.0, 4.2)) < 0.06


def test_an_object_that_appears_and_disappears_has_both_times():
    (found_object,) = found_objects(lambda time: [drives.body(4.5, 1.2, 0.0, (0.6, 0.6))] if 3.0 <= time < 7.0 else [])
    assert found_object.appear_time == pytest.approx(3.0, abs=0.15)
    assert found_object.disappear_time == pytest.approx(7.0, abs=0.25)


def test_crossing_person_is_tracked():
    def walk(time):
        return 5.5, 0.6 + 0.4 * time, 0.0

    (found_object,) = found_objects(lambda time: [drives.body(*walk(time), (0.25,))])
    assert found_object.is_moving and found_object.is_cylinder
    assert rmse(found_object, walk) < 0.1


def test_a_cart_that_waits_and_then_crosses_is_one_object():
    def cart(time):
        return 6.0, 1.0 + min(max(0.8 * (time - 4.0), 0.0), 4.0), math.pi / 2

    (found_object,) = found_objects(lambda time: [drives.body(*cart(time), (0.9, 0.6))])
    assert found_object.is_moving and not found_object.is_cylinder
    assert rmse(found_object, cart) < 0.3
    assert found_object.size == pytest.approx((0.9, 0.6), abs=0.15)
    waiting_times = [time for time, _, y, _ in found_object.keyframes if y < 1.15]
    assert max(waiting_times) == pytest.approx(4.0, abs=0.5)
