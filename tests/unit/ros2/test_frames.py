"""Tests of frame names in the user's ROS graph, and of the order in which transforms are published."""

from simscen.ros2.graph_names import FrameNames
from simscen.ros2.messages import transforms_first


def test_transforms_are_published_before_the_readings_that_need_them() -> None:
    messages = [("/scan", b"1"), ("/odom", b"2"), ("/tf", b"3"), ("/scan", b"4"), ("/tf", b"5")]
    assert [data for _, data in transforms_first(messages)] == [b"3", b"5", b"1", b"2", b"4"]


def test_the_base_frame_has_its_own_and_a_second_name() -> None:
    assert FrameNames([], None).base_frames == ["base_link"]
    assert FrameNames([], "base_footprint").base_frames == ["base_link", "base_footprint"]
    assert FrameNames(["base_link:=chassis"], "base_footprint").base_frames == ["chassis", "base_footprint"]
    assert FrameNames(["base_link:=base_footprint"], "base_footprint").base_frames == ["base_footprint"]


def test_a_message_without_renamed_frames_is_unchanged() -> None:
    data = b"bytes that are no message"
    assert FrameNames(["lidar:=base_scan"], "base_footprint").apply("/odom", None, data) is data
