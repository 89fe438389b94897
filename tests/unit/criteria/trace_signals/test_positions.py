"""Tests of signals about positions of objects, regions, and plans, against closed forms."""

import itertools
import math
import tracemalloc
from dataclasses import replace

import numpy as np
import pytest
import shapely
from signal_values import signal, value_at

from simscen.core.geometry.polygons import points_in_polygon
from simscen.core.messages.navigation import Path
from simscen.core.records.trace import Samples
from simscen.criteria.findings import MissingEvidence
from simscen.criteria.trace_signals.catalog import read_signal
from simscen.testing.synthetic_trace import synthetic_case, synthetic_trace


def test_distance_to_an_absent_object_is_infinite():
    words = {
        "seconds": 4,
        "truth": [[0, 1, -2]],
        "objects": {"cart": [[0, 4, 2]]},
        "events": [[1, "object.spawned", "cart"], [3, "object.removed", "cart"]],
    }
    values = signal("distance_to", words, object="cart")
    assert [value_at(values, t) for t in (0.975, 1.0, 2.975, 3.0)] == [math.inf, 5.0, 5.0, math.inf]


def test_distance_to_static_objects():
    words = {"seconds": 1, "truth": [[0, 1, -2]], "events": [[0, "object.spawned", "box", {"x": 1.0, "y": 0.0}]]}
    case = {"goals": [{"name": "shelf", "pose": [4, 2, 0]}]}
    assert signal("distance_to", words, case, goal="shelf")[0] == 5.0
    assert signal("distance_to", words, case, point=[7, 6])[0] == 10.0
    assert signal("distance_to", words, case, object="box")[0] == 2.0
    with pytest.raises(MissingEvidence, match="`cart` never existed"):
        signal("distance_to", words, case, object="cart")
    with pytest.raises(MissingEvidence, match="no goal `self`"):
        signal("distance_to", words, case, goal="self")


def test_remaining_plan_length_starts_at_the_estimated_position():
    words = {
        "seconds": 4,
        "truth": [[0, 9, 9], [4, 9, 8]],
        "belief": [[0, 0, 0.5], [2, 2, 0.5], [4, 2, 2]],
        "plans": [[1, [[0, 0], [2, 0], [2, 3]]]],
    }
    left = signal("distance_remaining", words, {"goals": [{"name": "a", "pose": [9, 0, 0]}]})
    assert value_at(left, 0) == 9.0
    assert value_at(left, 1.0) == pytest.approx(4.0)
    assert value_at(left, 4.0) == pytest.approx(1.0)


def test_newer_plan_replaces_the_old_one():
    words = {"seconds": 4, "truth": [[0, 1, 1]], "plans": [[1, [[0, 0], [2, 0]]], [2, [[0, 4], [2, 4]]]]}
    assert [value_at(signal("plan_deviation", words), t) for t in (0.975, 1.0, 1.975, 2.0)] == [0, 1, 1, 3]
    with pytest.raises(MissingEvidence, match="no plan"):
        signal("plan_deviation", {"seconds": 1, "truth": [[0, 0, 0]]})


def test_plan_after_the_last_sample_is_ignored():
    trace = synthetic_trace({"seconds": 1, "truth": [[0, 1, 1]]})
    late = Path(np.array([[0.0, 0.0, 0.0], [2.0, 0.0, 0.0]]), 241)
    with pytest.raises(MissingEvidence, match="no plan"):
        read_signal("plan_deviation", replace(trace, plans=(late,)), synthetic_case({}), {})


def test_deviation_from_a_plan_of_one_point_is_the_distance_to_it():
    trace = synthetic_trace({"seconds": 1, "truth": [[0, 3, 4]]})
    trace = replace(trace, plans=(Path(np.array([[0.0, 0.0, 0.0]]), 0), Path()))
    assert set(read_signal("plan_deviation", trace, synthetic_case({}), {})) == {5.0}


def test_a_robot_is_in_a_region_with_its_center():
    case = {"regions": {"hall": [[1, -1], [3, -1], [3, 1], [2, 0], [1, 1]]}}
    values = signal("in_region", {"seconds": 4, "truth": [[0, 0, 0.5], [4, 4, 0.5]]}, case, region="hall")
    assert [value_at(values, t) for t in (0.5, 1.2, 2.0, 2.8, 3.5)] == [0, 1, 0, 1, 0]
    with pytest.raises(MissingEvidence, match="no region `hal`"):
        signal("in_region", {"seconds": 4, "truth": [[0, 0, 0.5]]}, case, region="hal")


@pytest.mark.parametrize("corners", [[[1, 0], [0, 1], [-1, 0], [0, -1]], [[1, 0], [0, -1], [-1, 0], [0, 1]]])
def test_point_at_the_height_of_a_corner_is_classified_correctly(corners):
    points = np.array([[-2.0, 0.0], [-0.5, 0.0], [0.0, 0.0], [0.5, 0.0], [2.0, 0.0], [-0.5, 1.0], [-0.5, -1.0]])
    assert points_in_polygon(corners, points).tolist() == [False, True, True, True, False, False, False]


def test_each_point_is_in_one_of_two_adjacent_regions():
    square, right, above = (np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) + by for by in ([0, 0], [1, 0], [0, 1]))
    border = np.array([[0.0, 0.5], [0.5, 0.0], [1.0, 0.5], [0.5, 1.0]])
    assert points_in_polygon(square.tolist(), border).tolist() == [True, True, False, False]
    assert points_in_polygon(right.tolist(), border).tolist() == [False, False, True, False]
    assert points_in_polygon(above.tolist(), border).tolist() == [False, False, False, True]


def test_points_inside_equal_those_of_shapely():
    corners = [[0, 0], [4, 1], [3, 5], [2, 1.5], [-1, 4]]
    rng = np.random.default_rng(5)
    points = rng.uniform(-2, 6, (400, 2))
    within = shapely.contains_xy(shapely.Polygon(corners), *points.T)
    assert points_in_polygon(corners, points).tolist() == within.tolist()


def test_the_nearest_point_of_a_plan_is_found_among_long_and_short_steps():
    rng = np.random.default_rng(2)
    way = np.cumsum(rng.normal(0, [[1.0, 1.0]] * 10 + [[0.02, 0.02]] * 30, (40, 2)), axis=0)
    robot = rng.normal(0, 4, (81, 2))
    trace = synthetic_trace({"seconds": 2, "truth": [[0, 0, 0]]})
    trace = replace(
        trace,
        truth=Samples(trace.truth.ticks, np.column_stack((robot, np.zeros(81)))),
        plans=(Path(np.column_stack((way, np.zeros(40)))),),
    )
    fine = np.concatenate([np.linspace(a, b, 2000) for a, b in itertools.pairwise(way)])
    expected = [np.hypot(*(fine - point).T).min() for point in robot]
    assert read_signal("plan_deviation", trace, synthetic_case({}), {}) == pytest.approx(expected, abs=1e-3)


def _distance_to_box(events, samples):
    """Return the distance from the origin to `box`, with samples [tick, x]."""
    trace = synthetic_trace({"seconds": 4, "truth": [[0, 0, 0]], "events": events})
    ticks, x = np.array(samples).T
    box = Samples(ticks, np.column_stack((x, 0 * x, 0 * x)).astype(float))
    return read_signal("distance_to", replace(trace, objects={"box": box}), synthetic_case({}), {"object": "box"})


def test_object_that_is_spawned_again_is_at_its_new_position_at_once():
    events = [
        [0, "object.spawned", "box", {"x": 1, "y": 0}],
        [1, "object.removed", "box"],
        [2, "object.spawned", "box", {"x": 5, "y": 0}],
    ]
    values = _distance_to_box(events, [[0, 2], [240, 2], [600, 6]])
    assert [value_at(values, t) for t in (0, 0.975, 1, 1.975, 2, 2.475, 2.5)] == [2, 2, math.inf, math.inf, 5, 5, 6]


def test_object_that_replaces_another_has_its_own_position_before_its_first_sample():
    events = [[0, "object.spawned", "box", {"x": 1, "y": 0}], [1, "object.spawned", "box", {"x": 3, "y": 4}]]
    values = _distance_to_box([*events, [3, "object.spawned", "box", {"x": 6, "y": 8}]], [[0, 1], [240, 1], [480, 7]])
    assert [value_at(values, t) for t in (0.975, 1, 1.975, 2, 2.975, 3, 4)] == [1, 5, 5, 7, 7, 10, 10]


def test_object_without_samples_is_where_it_was_spawned_last():
    events = [[t, "object.spawned", "box", {"x": x, "y": y}] for t, x, y in ((0, 3, 4), (2, 0, 1))]
    words = {"seconds": 4, "truth": [[0, 0, 0]], "events": [*events, [1, "object.spawned", "cart", {"x": 9, "y": 9}]]}
    assert [value_at(signal("distance_to", words, object="box"), t) for t in (0, 1.975, 2, 4)] == [5, 5, 1, 1]


@pytest.mark.parametrize("data", [{"x": 1.0}, {"y": 1.0}, {"x": "1", "y": "1"}, {}])
def test_object_spawned_without_a_position_is_missing_evidence(data):
    words = {"seconds": 1, "truth": [[0, 0, 0]], "events": [[0, "object.spawned", "box", data]]}
    with pytest.raises(MissingEvidence, match="`box` never existed, or does not move"):
        signal("distance_to", words, object="box")


def test_deviation_from_a_long_plan_needs_little_memory():
    plan = [[x, math.sin(x)] for x in np.arange(0.0, 100.0, 0.05).tolist()]
    words = {"seconds": 200, "truth": [[0, 0, 0], [200, 99, 0]], "plans": [[0, plan]]}
    tracemalloc.start()
    values = signal("plan_deviation", words)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    expected = shapely.distance(shapely.LineString(plan), shapely.points(np.linspace(0, 99, 8001), 0.0))
    assert values == pytest.approx(expected, abs=1e-6)
    assert peak < 250e6
