import numpy as np

from simscen.core.geometry.polylines import path_corners


def test_corners_of_a_path_are_where_it_leaves_straight_lines():
    steps = np.linspace(0.0, 2.0, 21)
    there = np.column_stack((steps, 0.01 * np.sin(20 * steps)))
    up = np.column_stack((np.full(20, 2.0), steps[1:]))
    assert path_corners(np.vstack((there, up)), 0.1) == [20]
    assert path_corners(there, 0.1) == []
    assert path_corners(np.vstack((there, there[-2::-1])), 0.1) == [20], "where it turns back"
