"""Tests of keepout distances against shapely."""

import numpy as np
import pytest
import shapely
import shapely.affinity
from hypothesis import given, settings
from hypothesis import strategies as st

from simscen.core.records.verdict import Status
from simscen.criteria.registry import AnyCriterion
from simscen.judge.evaluation import judge
from simscen.testing.synthetic_trace import synthetic_case, synthetic_trace

SQUARE = [[-0.3, -0.3], [0.3, -0.3], [0.3, 0.3], [-0.3, 0.3]]
NOTCHED = [[0, 0], [3, 0], [3, 3], [1.6, 3], [1.6, 1], [1.4, 1], [1.4, 3], [0, 3]]


def judged(region, truth, footprint=SQUARE, seconds=10, distance=0.0, events=(), radius=0.2):
    entry = AnyCriterion.model_validate({"keepout": {"region": "wet", "distance": distance}})
    trace = synthetic_trace({"seconds": seconds, "truth": truth, "events": events})
    case = synthetic_case({"regions": {"wet": region}, "footprint": footprint, "inscribed_radius": radius})
    (verdict,) = judge([entry], trace, case)
    (finding,) = verdict.findings
    return finding


def star(rng, size, corners):
    angles = np.sort(rng.uniform(0, 2 * np.pi, corners))
    radii = rng.uniform(0.2, 1.0, corners) * size
    return np.column_stack((radii * np.cos(angles), radii * np.sin(angles))).tolist()


def placed(outline, x, y, yaw):
    turned = shapely.affinity.rotate(shapely.Polygon(outline), yaw, origin=(0, 0), use_radians=True)
    return shapely.affinity.translate(turned, x, y)


def convex(corners):
    return [list(corner) for corner in shapely.MultiPoint(corners).convex_hull.exterior.coords[:-1]]


def way_out(moved, region):
    """How far two convex polygons overlap: the origin's distance to the border of their Minkowski difference."""
    pairs = [(rx - mx, ry - my) for rx, ry in region.exterior.coords for mx, my in moved.exterior.coords]
    return shapely.MultiPoint(pairs).convex_hull.exterior.distance(shapely.Point(0, 0))


SEEDS = st.integers(0, 2**32 - 1)


@given(SEEDS)
@settings(deadline=None)
def test_sign_and_positive_distances_equal_those_of_shapely(seed):
    rng = np.random.default_rng(seed)
    hull, region = star(rng, 0.8, rng.integers(3, 8)), star(rng, 2.0, rng.integers(3, 12))
    if not (shapely.Polygon(hull).is_valid and shapely.Polygon(region).is_valid):
        return
    x, y, yaw = *rng.uniform(-2.5, 2.5, 2), rng.uniform(-3, 3)
    found = judged(region, [[0, x, y, yaw]], hull, seconds=0.1)
    moved = placed(hull, x, y, yaw)
    overlap = moved.intersection(shapely.Polygon(region)).area
    if overlap > 1e-9:
        assert found.status is Status.FAIL
        assert found.value < 0
    else:
        assert found.value == pytest.approx(moved.distance(shapely.Polygon(region)), abs=1e-6)


@given(SEEDS)
@settings(deadline=None)
def test_penetration_depth_is_the_shortest_separating_translation(seed):
    rng = np.random.default_rng(seed)
    hull, region = convex(star(rng, 0.8, 6)), convex(star(rng, 2.0, 7))
    x, y, yaw = *rng.uniform(-1.5, 1.5, 2), rng.uniform(-3, 3)
    moved = placed(hull, x, y, yaw)
    if moved.intersection(shapely.Polygon(region)).area > 1e-9:
        found = judged(region, [[0, x, y, yaw]], hull, seconds=0.1)
        assert found.value == pytest.approx(-way_out(moved, shapely.Polygon(region)), abs=1e-9)


@pytest.mark.parametrize("yaw", [0.0, 0.4, np.pi / 2])
def test_footprint_across_a_narrow_region_is_inside(yaw):
    strip = [[-0.05, -5], [0.05, -5], [0.05, 5], [-0.05, 5]]
    found = judged(strip, [[0, 0, 0, yaw]])
    assert found.status is Status.FAIL
    assert found.value < -0.05


def test_robot_entirely_inside_a_region_is_inside():
    assert judged([[-5, -5], [5, -5], [5, 5], [-5, 5]], [[0, 1, 0, 0]]).value == pytest.approx(-4.3)


def test_notch_of_a_region_is_outside():
    narrow = [[-0.05, -0.3], [0.05, -0.3], [0.05, 0.3], [-0.05, 0.3]]
    assert judged(NOTCHED, [[0, 1.5, 2, 0]], narrow).value == pytest.approx(0.05)
    assert judged(NOTCHED, [[0, 1.5, 2, 0]], SQUARE).value < 0


def test_region_between_two_samples_is_detected():
    dash = [[5.0, -1], [5.02, -1], [5.02, 1], [5.0, 1]]
    fly = [[-0.01, -0.01], [0.01, -0.01], [0.01, 0.01], [-0.01, 0.01]]
    found = judged(dash, [[0, 0, 0, 0], [1.0, 13.0, 0, 0]], fly, seconds=1)  # 0.33 m from sample to sample
    assert found.status is Status.FAIL
    assert found.value == pytest.approx(-0.02, abs=0.006)


def test_teleported_robot_is_not_between_its_poses():
    wall = [[4, -1], [6, -1], [6, 1], [4, 1]]
    way = [[0, 5, -5, 0], [5, 5, -5, 0], [5.02, 5, 10, 0], [10, 5, 10, 0]]
    carried = [[5.0, "robot.placed", ""]]
    assert judged(wall, way, events=carried).value == pytest.approx(3.7)
    assert judged(wall, way).status is Status.FAIL


def test_turn_across_pi_is_interpolated_the_short_way():
    way = [[0, 0, 0, 3.13], [1, 0, 0, -3.13]]
    pole = [[0.9, -0.1], [1.1, -0.1], [1.1, 0.1], [0.9, 0.1]]
    tail = [[-1.5, -0.05], [0.1, -0.05], [0.1, 0.05], [-1.5, 0.05]]
    west = [[-1.6, -0.5], [-1.55, -0.5], [-1.55, 0.5], [-1.6, 0.5]]
    assert judged(west, way, tail, seconds=1).value > 1.4
    assert judged(pole, way, tail, seconds=1).status is Status.FAIL


def test_without_a_footprint_the_robot_is_a_disc_of_its_inscribed_radius():
    assert judged([[1, -1], [2, -1], [2, 1], [1, 1]], [[0, 0, 0, 0]], [], radius=0.3).value == pytest.approx(0.7)


@pytest.mark.parametrize("ring", [[[0, 0], [1, 0], [2, 0]], [*NOTCHED, *NOTCHED], [[0, 0], [1, 1], [1, 0], [0, 1]]])
def test_degenerate_region_is_an_error(ring):
    assert judged(ring, [[0, 9, 9, 0]]).status is Status.ERROR


FLY = [[-0.001, -0.001], [0.001, -0.001], [0.001, 0.001], [-0.001, 0.001]]
TAIL = [[-1.5, -0.05], [0.1, -0.05], [0.1, 0.05], [-1.5, 0.05]]


def around(x, y, r):
    return [[x - r, y - r], [x + r, y - r], [x + r, y + r], [x - r, y + r]]


def in_one_step(region, start, end, footprint=FLY, **more):
    return judged(region, [[0, *start], [0.025, *end]], footprint, seconds=0.025, **more)


@pytest.mark.parametrize(("start", "end", "tick"), [((0, 0), (0.3, 0), 6), ((0.3, 0), (0, 0), 0)])
def test_minimum_distance_can_be_at_a_sample(start, end, tick):
    found = in_one_step(around(1, 0, 0.5), start, end)
    assert (found.value, found.tick) == (pytest.approx(0.199, abs=1e-9), tick)


@pytest.mark.parametrize("turn", [2.0, -2.0])
def test_hull_that_sweeps_a_region_between_two_samples_is_inside(turn):
    at = np.pi + 0.3 * turn
    swept = around(1.4 * np.cos(at), 1.4 * np.sin(at), 0.02)
    assert in_one_step(swept, (0, 0, 0), (0, 0, turn), TAIL).value < 0
    beyond = around(1.7 * np.cos(at), 1.7 * np.sin(at), 0.02)
    assert in_one_step(beyond, (0, 0, 0), (0, 0, turn), TAIL).value > 0.1


@pytest.mark.parametrize(("x", "y"), [(0.5, 0.0), (0.0, 0.5), (0.35, -0.35)])
def test_motion_in_any_direction_between_two_samples_is_searched(x, y):
    assert in_one_step(around(x, y, 0.02), (0, 0), (2 * x, 2 * y)).value < 0


def test_minimum_distance_is_exact_to_half_a_centimeter():
    tip = [[0.0165, 0.0], [0.0166, -1.0], [0.0164, -1.0]]
    assert in_one_step(tip, (0, 0), (0.022, 0), [], radius=0.0).value < 0.005


@pytest.mark.parametrize("side", [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)])
def test_disc_has_the_same_distance_in_all_directions(side):
    assert judged(around(*side, 0.25), [[0, 0, 0, 0]], [], radius=0.3).value == pytest.approx(0.45)
