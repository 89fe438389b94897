"""Tests of keepout distances against shapely."""

import numpy as np
import pytest
import shapely
import shapely.affinity
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from simscen.core.records.verdict import Status
from simscen.criteria.registry import AnyCriterion
from simscen.judge.evaluation import judge
from simscen.testing.synthetic_trace import synthetic_case, synthetic_trace

SQUARE = [[-0.3, -0.3], [0.3, -0.3], [0.3, 0.3], [-0.3, 0.3]]
NOTCHED = [[0, 0], [3, 0], [3, 3], [1.6, 3], [1.6, 1], [1.4, 1], [1.4, 3], [0, 3]]


def keepout_finding(region, truth, footprint=SQUARE, seconds=10, distance=0.0, events=(), radius=0.2):
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
    rotated = shapely.affinity.rotate(shapely.Polygon(outline), yaw, origin=(0, 0), use_radians=True)
    return shapely.affinity.translate(rotated, x, y)


def convex(corners):
    return [list(corner) for corner in shapely.MultiPoint(corners).convex_hull.exterior.coords[:-1]]


def penetration_depth(footprint, region):
    """Return the distance of the origin to the border of the Minkowski difference of two convex polygons, in m."""
    pairs = [(rx - fx, ry - fy) for rx, ry in region.exterior.coords for fx, fy in footprint.exterior.coords]
    return shapely.MultiPoint(pairs).convex_hull.exterior.distance(shapely.Point(0, 0))


SEEDS = st.integers(0, 2**32 - 1)


@given(SEEDS)
@settings(deadline=None)
def test_sign_and_positive_distances_equal_those_of_shapely(seed):
    rng = np.random.default_rng(seed)
    footprint, region = star(rng, 0.8, rng.integers(3, 8)), star(rng, 2.0, rng.integers(3, 12))
    assume(shapely.Polygon(footprint).is_valid and shapely.Polygon(region).is_valid)
    x, y, yaw = *rng.uniform(-2.5, 2.5, 2), rng.uniform(-3, 3)
    finding = keepout_finding(region, [[0, x, y, yaw]], footprint, seconds=0.1)
    footprint_at_pose = placed(footprint, x, y, yaw)
    overlap = footprint_at_pose.intersection(shapely.Polygon(region)).area
    if overlap > 1e-9:
        assert finding.status is Status.FAIL
        assert finding.value < 0
    else:
        assert finding.value == pytest.approx(footprint_at_pose.distance(shapely.Polygon(region)), abs=1e-6)


@given(SEEDS)
@settings(deadline=None)
def test_penetration_depth_is_the_shortest_separating_translation(seed):
    rng = np.random.default_rng(seed)
    footprint, region = convex(star(rng, 0.8, 6)), convex(star(rng, 2.0, 7))
    x, y, yaw = *rng.uniform(-1.5, 1.5, 2), rng.uniform(-3, 3)
    footprint_at_pose = placed(footprint, x, y, yaw)
    assume(footprint_at_pose.intersection(shapely.Polygon(region)).area > 1e-9)
    finding = keepout_finding(region, [[0, x, y, yaw]], footprint, seconds=0.1)
    assert finding.value == pytest.approx(-penetration_depth(footprint_at_pose, shapely.Polygon(region)), abs=1e-9)


@pytest.mark.parametrize("yaw", [0.0, 0.4, np.pi / 2])
def test_footprint_across_a_narrow_region_is_inside(yaw):
    strip = [[-0.05, -5], [0.05, -5], [0.05, 5], [-0.05, 5]]
    finding = keepout_finding(strip, [[0, 0, 0, yaw]])
    assert finding.status is Status.FAIL
    assert finding.value < -0.05


def test_robot_entirely_inside_a_region_is_inside():
    assert keepout_finding([[-5, -5], [5, -5], [5, 5], [-5, 5]], [[0, 1, 0, 0]]).value == pytest.approx(-4.3)


def test_notch_of_a_region_is_outside():
    narrow_footprint = [[-0.05, -0.3], [0.05, -0.3], [0.05, 0.3], [-0.05, 0.3]]
    assert keepout_finding(NOTCHED, [[0, 1.5, 2, 0]], narrow_footprint).value == pytest.approx(0.05)
    assert keepout_finding(NOTCHED, [[0, 1.5, 2, 0]], SQUARE).value < 0


def test_region_between_two_samples_is_detected():
    narrow_region = [[5.0, -1], [5.02, -1], [5.02, 1], [5.0, 1]]
    tiny_footprint = [[-0.01, -0.01], [0.01, -0.01], [0.01, 0.01], [-0.01, 0.01]]
    finding = keepout_finding(
        narrow_region, [[0, 0, 0, 0], [1.0, 13.0, 0, 0]], tiny_footprint, seconds=1
    )  # 0.33 m from sample to sample
    assert finding.status is Status.FAIL
    assert finding.value == pytest.approx(-0.02, abs=0.006)


def test_teleported_robot_is_not_between_its_poses():
    region = [[4, -1], [6, -1], [6, 1], [4, 1]]
    poses = [[0, 5, -5, 0], [5, 5, -5, 0], [5.02, 5, 10, 0], [10, 5, 10, 0]]
    placement = [[5.0, "robot.placed", ""]]
    assert keepout_finding(region, poses, events=placement).value == pytest.approx(3.7)
    assert keepout_finding(region, poses).status is Status.FAIL


def test_turn_across_pi_is_interpolated_the_short_way():
    poses = [[0, 0, 0, 3.13], [1, 0, 0, -3.13]]
    pole = [[0.9, -0.1], [1.1, -0.1], [1.1, 0.1], [0.9, 0.1]]
    long_tail = [[-1.5, -0.05], [0.1, -0.05], [0.1, 0.05], [-1.5, 0.05]]
    west = [[-1.6, -0.5], [-1.55, -0.5], [-1.55, 0.5], [-1.6, 0.5]]
    assert keepout_finding(west, poses, long_tail, seconds=1).value > 1.4
    assert keepout_finding(pole, poses, long_tail, seconds=1).status is Status.FAIL


def test_without_a_footprint_the_robot_is_a_disc_of_its_inscribed_radius():
    assert keepout_finding([[1, -1], [2, -1], [2, 1], [1, 1]], [[0, 0, 0, 0]], [], radius=0.3).value == pytest.approx(
        0.7
    )


@pytest.mark.parametrize("region", [[[0, 0], [1, 0], [2, 0]], [*NOTCHED, *NOTCHED], [[0, 0], [1, 1], [1, 0], [0, 1]]])
def test_degenerate_region_is_an_error(region):
    assert keepout_finding(region, [[0, 9, 9, 0]]).status is Status.ERROR


TINY_FOOTPRINT = [[-0.001, -0.001], [0.001, -0.001], [0.001, 0.001], [-0.001, 0.001]]
LONG_TAIL = [[-1.5, -0.05], [0.1, -0.05], [0.1, 0.05], [-1.5, 0.05]]


def square_around(x, y, half_side):
    return [
        [x - half_side, y - half_side],
        [x + half_side, y - half_side],
        [x + half_side, y + half_side],
        [x - half_side, y + half_side],
    ]


def finding_of_one_step(region, start, end, footprint=TINY_FOOTPRINT, **options):
    return keepout_finding(region, [[0, *start], [0.025, *end]], footprint, seconds=0.025, **options)


@pytest.mark.parametrize(("start", "end", "tick"), [((0, 0), (0.3, 0), 6), ((0.3, 0), (0, 0), 0)])
def test_minimum_distance_can_be_at_a_sample(start, end, tick):
    finding = finding_of_one_step(square_around(1, 0, 0.5), start, end)
    assert (finding.value, finding.tick) == (pytest.approx(0.199, abs=1e-9), tick)


@pytest.mark.parametrize("rotation", [2.0, -2.0])
def test_footprint_that_sweeps_a_region_between_two_samples_is_inside(rotation):
    angle = np.pi + 0.3 * rotation
    swept = square_around(1.4 * np.cos(angle), 1.4 * np.sin(angle), 0.02)
    assert finding_of_one_step(swept, (0, 0, 0), (0, 0, rotation), LONG_TAIL).value < 0
    beyond = square_around(1.7 * np.cos(angle), 1.7 * np.sin(angle), 0.02)
    assert finding_of_one_step(beyond, (0, 0, 0), (0, 0, rotation), LONG_TAIL).value > 0.1


@pytest.mark.parametrize(("x", "y"), [(0.5, 0.0), (0.0, 0.5), (0.35, -0.35)])
def test_motion_in_any_direction_between_two_samples_is_searched(x, y):
    assert finding_of_one_step(square_around(x, y, 0.02), (0, 0), (2 * x, 2 * y)).value < 0


def test_minimum_distance_is_exact_to_half_a_centimeter():
    spike = [[0.0165, 0.0], [0.0166, -1.0], [0.0164, -1.0]]
    assert finding_of_one_step(spike, (0, 0), (0.022, 0), [], radius=0.0).value < 0.005


@pytest.mark.parametrize("center", [(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)])
def test_disc_has_the_same_distance_in_all_directions(center):
    assert keepout_finding(square_around(*center, 0.25), [[0, 0, 0, 0]], [], radius=0.3).value == pytest.approx(0.45)
