import numpy as np

from simscen.worlds.loops import loops


def ring(*corners):
    return [(a, b) for a, b in zip(corners, [*corners[1:], corners[0]], strict=True)]


def test_shuffled_segments_become_their_closed_outlines_again():
    square, triangle = ring((0, 0), (1, 0), (1, 1), (0, 1)), ring((5, 0), (6, 0), (5, 2))
    segments = np.array([*square, *triangle], dtype=float)
    found = loops(segments[np.random.default_rng(0).permutation(7)])
    assert sorted(len(chain) for chain in found) == [4, 5]
    assert all(chain[0] == chain[-1] for chain in found)
    assert {point for chain in found for point in chain} == {tuple(p) for p in segments[:, 0].tolist()}


def test_points_on_straight_lines_are_left_out():
    (chain,) = loops(np.array(ring((0, 0), (0.3, 0), (1, 0), (1, 1), (0.5, 1), (0, 1)), dtype=float))
    assert chain == [(0, 0), (1, 0), (1, 1), (0, 1), (0, 0)]


def test_open_chains_are_followed_from_their_beginning():
    segments = np.array([[(1, 0), (2, 1)], [(0, 0), (1, 0)]], dtype=float)
    assert loops(segments) == [[(0, 0), (1, 0), (2, 1)]]


def test_no_segments_make_no_loops():
    assert loops(np.empty((0, 2, 2))) == []
