"""Tests of the rolling window of a costmap."""

import math

import numpy as np
import pytest

from simscen.core.geometry import Pose2
from simscen.stack.costmap.grid_frame import GridFrame, clip_goal, shift_layer, should_roll, window_around


def test_cells_of_all_windows_are_aligned() -> None:
    first, second = (
        window_around(Pose2(0.013, 0.0), (8.0, 8.0), 0.05),
        window_around(Pose2(1.234, -2.7), (8.0, 8.0), 0.05),
    )
    steps = (np.array(second.origin) - np.array(first.origin)) / 0.05
    assert steps == pytest.approx(np.round(steps), abs=1e-6)
    assert first.shape == (160, 160)


def test_window_moves_when_the_robot_is_an_eighth_of_its_size_off_center() -> None:
    frame = window_around(Pose2(0, 0), (8.0, 8.0), 0.05)
    assert not should_roll(frame, Pose2(0.9, -0.9))
    assert should_roll(frame, Pose2(0.0, 1.1))


def test_marks_keep_their_position_and_are_lost_outside_the_window() -> None:
    before, after = window_around(Pose2(0, 0), (8.0, 8.0), 0.05), window_around(Pose2(3, 0), (8.0, 8.0), 0.05)
    marks = np.zeros(before.shape, dtype=bool)
    cells = before.cells(np.array([[2.0, 1.0], [-3.0, 0.0]]))
    marks[cells[:, 0], cells[:, 1]] = True
    found = after.centers(np.argwhere(shift_layer(marks, before, after, False)))
    assert found == pytest.approx(before.centers(cells[:1]))


@pytest.mark.parametrize("pose", [Pose2(9, 0), Pose2(-9, 0), Pose2(0, 20), Pose2(-8, -8)])
def test_disjoint_window_starts_empty(pose: Pose2) -> None:
    before, after = window_around(Pose2(0, 0), (8.0, 8.0), 0.05), window_around(pose, (8.0, 8.0), 0.05)
    assert np.isnan(shift_layer(np.ones(before.shape), before, after, np.nan)).all()


@pytest.mark.parametrize(
    ("goal", "projected"),
    [((1.0, 1.0), (1.0, 1.0)), ((10.0, 0.0), (3.4, 0.0)), ((8.0, 8.0), (3.4, 3.4)), ((0.0, -9.0), (0.0, -3.4))],
)
def test_goal_beyond_the_window_is_projected_into_it(goal: tuple[float, float], projected: tuple[float, float]) -> None:
    frame = window_around(Pose2(0, 0), (8.0, 8.0), 0.05)
    assert clip_goal(frame, Pose2(0, 0), Pose2(*goal))[:2] == pytest.approx(projected)


def test_point_whose_cell_is_outside_the_grid_after_rounding_is_not_covered() -> None:
    frame, y = GridFrame((0.0, 0.0), 0.03, (9, 9)), math.nextafter(9 * 0.03, 0.0)
    assert frame.cell(0.1, y)[0] == 9
    assert not frame.covers(0.1, y)
