import math

import numpy as np
import pytest

from simscen.core.geometry import Pose2
from simscen.core.messages.navigation import Path
from simscen.stack.controllers.path_handler import PathTracker


def straight(length: float = 4.0) -> Path:
    x = np.arange(0.0, length + 1e-9, 0.05)
    return Path(np.column_stack((x, np.zeros_like(x), np.zeros_like(x))))


def there_and_back() -> Path:
    """Forward 1 m along x, then backward 0.5 m."""
    x = np.concatenate((np.arange(0.0, 1.001, 0.05), np.arange(0.95, 0.49, -0.05)))
    return Path(np.column_stack((x, np.zeros_like(x), np.zeros_like(x))))


def test_the_carrot_is_on_the_circle_around_the_robot_and_on_the_path() -> None:
    track = PathTracker(straight())
    pose = Pose2(1.013, 0.2, 0.0)
    track.locate(pose)
    x, y = track.carrot(pose, 0.5)
    assert (x, y) == pytest.approx((1.013 + math.sqrt(0.25 - 0.04), 0.0), abs=1e-9)


def test_carrot_at_the_end_is_the_end_or_interpolated_beyond_it() -> None:
    track = PathTracker(straight())
    pose = Pose2(3.8, 0.0, 0.0)
    track.locate(Pose2(1.4, 0.0))
    track.locate(Pose2(2.8, 0.0))
    track.locate(pose)
    assert track.carrot(pose, 0.5) == pytest.approx((4.0, 0.0))
    assert track.carrot(pose, 0.5, "path") == pytest.approx((4.3, 0.0))
    assert track.carrot(pose, 0.5, "heading") == pytest.approx((4.3, 0.0))


@pytest.mark.parametrize("end_yaw", [0.0, math.pi / 2, math.pi])
@pytest.mark.parametrize("copies", [0, 1])
def test_extension_of_the_path_is_independent_of_the_heading_at_the_goal(end_yaw: float, copies: int) -> None:
    points = straight(5.0).points.copy()
    points = np.vstack((points, *[points[-1:]] * copies))
    points[-1, 2] = end_yaw
    track = PathTracker(Path(points), search_distance=9.0)
    pose = Pose2(4.5, 0.0, 0.0)
    track.locate(pose)
    assert track.carrot(pose, 1.0, "path") == pytest.approx((5.5, 0.0))


def test_carrot_of_a_path_in_reverse_is_extended_backward() -> None:
    track = PathTracker(there_and_back())
    for x in (1.0, 0.7, 0.5):
        pose = Pose2(x, 0.0)
        track.locate(pose)
    assert track.carrot(pose, 0.5, "path") == pytest.approx((0.0, 0.0))
    assert track.carrot(pose, 0.5, "heading") == pytest.approx((0.0, 0.0))


def test_position_on_the_path_never_moves_back() -> None:
    track = PathTracker(straight())
    track.locate(Pose2(1.0, 0.0))
    track.locate(Pose2(0.2, 0.0))
    assert track.remaining() == pytest.approx(3.0)


def test_a_path_that_crosses_itself_is_followed_in_its_order() -> None:
    t = np.linspace(0, 2 * math.pi, 400)
    circle = np.column_stack((np.sin(t), 1 - np.cos(t), t))
    track = PathTracker(Path(circle))
    track.locate(Pose2(0.0, 0.0))
    assert track.remaining() == pytest.approx(2 * math.pi, abs=0.01)


def test_path_beyond_a_cusp_is_ignored_until_the_robot_reaches_it() -> None:
    track = PathTracker(there_and_back())
    track.locate(Pose2(0.8, 0.0))
    assert track.is_forward
    assert track.carrot(Pose2(0.8, 0.0), 0.5) == pytest.approx((1.0, 0.0))
    assert track.remaining_in_segment() == pytest.approx(0.2)


def test_only_the_search_distance_ahead_is_searched_for_the_nearest_point() -> None:
    """The path returns beside its start after 6 m."""
    out = [(x, 0.0) for x in np.arange(0.0, 3.0, 0.05)]
    back = [(x, 0.3) for x in np.arange(3.0, -0.01, -0.05)]
    points = np.array([*out, *back])
    yaw = np.arctan2(*np.diff(points, axis=0)[:, ::-1].T)
    path = Path(np.column_stack((points, [*yaw, yaw[-1]])))
    for distance, y in ((1.5, 0.0), (10.0, 0.3)):
        track = PathTracker(path, distance)
        track.locate(Pose2(0.0, 0.25))
        assert track.points[track.index, 1] == y
