"""Tests of the position on the path and of the carrot."""

import math

import numpy as np
import pytest

from simscen.core.geometry import Pose2
from simscen.core.messages.navigation import Path
from simscen.stack.controllers.path_handler import PathTracker


def straight_path(length: float = 4.0) -> Path:
    x = np.arange(0.0, length + 1e-9, 0.05)
    return Path(np.column_stack((x, np.zeros_like(x), np.zeros_like(x))))


def path_with_cusp() -> Path:
    """Return a path that leads 1 m forward along x, and then 0.5 m backward."""
    x = np.concatenate((np.arange(0.0, 1.001, 0.05), np.arange(0.95, 0.49, -0.05)))
    return Path(np.column_stack((x, np.zeros_like(x), np.zeros_like(x))))


def test_the_carrot_is_on_the_circle_around_the_robot_and_on_the_path() -> None:
    tracker = PathTracker(straight_path())
    pose = Pose2(1.013, 0.2, 0.0)
    tracker.locate(pose)
    x, y = tracker.carrot(pose, 0.5)
    assert (x, y) == pytest.approx((1.013 + math.sqrt(0.25 - 0.04), 0.0), abs=1e-9)


def test_carrot_at_the_end_of_the_path_is_the_end_or_beyond_it() -> None:
    tracker = PathTracker(straight_path())
    pose = Pose2(3.8, 0.0, 0.0)
    tracker.locate(Pose2(1.4, 0.0))
    tracker.locate(Pose2(2.8, 0.0))
    tracker.locate(pose)
    assert tracker.carrot(pose, 0.5) == pytest.approx((4.0, 0.0))
    assert tracker.carrot(pose, 0.5, "path") == pytest.approx((4.3, 0.0))
    assert tracker.carrot(pose, 0.5, "heading") == pytest.approx((4.3, 0.0))


@pytest.mark.parametrize("end_yaw", [0.0, math.pi / 2, math.pi])
@pytest.mark.parametrize("copies", [0, 1])
def test_extension_of_the_path_is_independent_of_the_heading_at_the_goal(end_yaw: float, copies: int) -> None:
    points = straight_path(5.0).points.copy()
    points = np.vstack((points, *[points[-1:]] * copies))
    points[-1, 2] = end_yaw
    tracker = PathTracker(Path(points), search_distance=9.0)
    pose = Pose2(4.5, 0.0, 0.0)
    tracker.locate(pose)
    assert tracker.carrot(pose, 1.0, "path") == pytest.approx((5.5, 0.0))


def test_carrot_of_a_path_in_reverse_is_extended_backward() -> None:
    tracker = PathTracker(path_with_cusp())
    for x in (1.0, 0.7, 0.5):
        pose = Pose2(x, 0.0)
        tracker.locate(pose)
    assert tracker.carrot(pose, 0.5, "path") == pytest.approx((0.0, 0.0))
    assert tracker.carrot(pose, 0.5, "heading") == pytest.approx((0.0, 0.0))


def test_position_on_the_path_never_moves_back() -> None:
    tracker = PathTracker(straight_path())
    tracker.locate(Pose2(1.0, 0.0))
    tracker.locate(Pose2(0.2, 0.0))
    assert tracker.remaining() == pytest.approx(3.0)


def test_position_on_a_closed_path_is_its_start_and_not_its_end() -> None:
    t = np.linspace(0, 2 * math.pi, 400)
    circle = np.column_stack((np.sin(t), 1 - np.cos(t), t))
    tracker = PathTracker(Path(circle))
    tracker.locate(Pose2(0.0, 0.0))
    assert tracker.remaining() == pytest.approx(2 * math.pi, abs=0.01)


def test_path_beyond_a_cusp_is_ignored_until_the_robot_reaches_it() -> None:
    tracker = PathTracker(path_with_cusp())
    tracker.locate(Pose2(0.8, 0.0))
    assert tracker.is_forward
    assert tracker.carrot(Pose2(0.8, 0.0), 0.5) == pytest.approx((1.0, 0.0))
    assert tracker.remaining_in_segment() == pytest.approx(0.2)


def test_nearest_point_is_searched_only_within_the_search_distance() -> None:
    """After 6 m, the path passes its start at a distance of 0.3 m."""
    outward = [(x, 0.0) for x in np.arange(0.0, 3.0, 0.05)]
    back = [(x, 0.3) for x in np.arange(3.0, -0.01, -0.05)]
    points = np.array([*outward, *back])
    yaw = np.arctan2(*np.diff(points, axis=0)[:, ::-1].T)
    path = Path(np.column_stack((points, [*yaw, yaw[-1]])))
    for distance, y in ((1.5, 0.0), (10.0, 0.3)):
        tracker = PathTracker(path, distance)
        tracker.locate(Pose2(0.0, 0.25))
        assert tracker.points[tracker.index, 1] == y
