"""Test of the corners of paths."""

import numpy as np

from simscen.core.geometry.polylines import path_corners


def test_corners_of_a_path_are_where_the_path_leaves_a_straight_line():
    steps = np.linspace(0.0, 2.0, 21)
    wave = np.column_stack((steps, 0.01 * np.sin(20 * steps)))
    line = np.column_stack((np.full(20, 2.0), steps[1:]))
    assert path_corners(np.vstack((wave, line)), 0.1) == [20]
    assert path_corners(wave, 0.1) == []
    assert path_corners(np.vstack((wave, wave[-2::-1])), 0.1) == [20], "where the path turns back"
