"""Tests of objects in the diagnosis: pose, presence, and distance."""

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from simscen.judge.movable_objects import movable_objects
from simscen.testing.synthetic_trace import synthetic_trace

SQUARE = [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]]
NOTCHED = [[0, 0], [3, 0], [3, 3], [2, 3], [2, 1], [1, 1], [1, 3], [0, 3]]


def spawn_event(at, name, x, y, yaw=0.0, parts=(SQUARE,)):
    return [at, "object.spawned", name, {"x": x, "y": y, "yaw": yaw, "parts": list(parts)}]


def objects_at(events, at, **trace_keys):
    return movable_objects(
        synthetic_trace({"seconds": 10, "truth": [[0, 0, 0]], "events": events, **trace_keys}), round(at * 240)
    )


@settings(max_examples=200, deadline=None)
@given(st.floats(-4, 4), st.floats(-4, 4), st.floats(-3.1, 3.1), st.sampled_from([SQUARE, NOTCHED]))
def test_distance_equals_that_of_shapely(x, y, yaw, outline):
    (table,) = objects_at([spawn_event(1, "thing", 0.5, -0.5, yaw, [outline])], 2)
    expected = shapely.Polygon(table.outlines[0]).distance(shapely.Point(x, y))
    assert table.distance(np.array([[x, y]]))[0] == pytest.approx(expected, abs=1e-9)


def test_repeated_and_level_corners_do_not_change_the_distance():
    diamond = [[1, 0], [0, 1], [0, 1], [-1, 0], [0, -1]]
    (table,) = objects_at([spawn_event(1, "thing", 0, 0, 0.0, [diamond])], 2)
    assert table.distance(np.array([[0.0, 0.0], [3.0, 0.0], [-3.0, 0.0], [0.0, 4.0]])).tolist() == [0.0, 2.0, 2.0, 3.0]


def test_distance_is_to_the_nearest_part():
    far = [[9, 9], [10, 9], [10, 10]]
    (table,) = objects_at([spawn_event(1, "table", 0, 0, parts=[far, SQUARE])], 2)
    assert table.distance(np.array([[1.5, 0.0], [9.9, 9.5]])).tolist() == pytest.approx([1.0, 0.0])


def test_objects_without_a_valid_outline_are_ignored():
    """Stacks of packages can report events with any data."""
    odd = [[1, "object.spawned", name, {"parts": parts}] for name, parts in (("a", [["a"]]), ("b", 3), ("c", [SQUARE]))]
    assert [thing.name for thing in objects_at(odd, 2)] == ["c"]


def test_object_exists_from_spawn_to_removal():
    events = [spawn_event(2, "crate", 3, 0), [5, "object.removed", "crate", {}], spawn_event(7, "crate", 4, 0)]
    assert [len(objects_at(events, at)) for at in (1.9, 2, 4.9, 5, 6.9, 7)] == [0, 1, 1, 0, 0, 1]
    assert objects_at(events, 8)[0].outlines[0].mean(axis=0).tolist() == [4.0, 0.0]


def test_object_is_at_its_last_observed_pose():
    events = [spawn_event(0, "cart", 0, 0), [4, "object.removed", "cart", {}], spawn_event(6, "cart", 5, 0)]
    path = {"cart": [[0, 0, 0], [3, 3, 0], [6, 3, 0], [8, 9, 0]]}
    assert objects_at(events, 2, objects=path)[0].outlines[0].mean(axis=0).tolist() == pytest.approx([2.0, 0.0])
    assert objects_at(events, 7, objects=path)[0].outlines[0].mean(axis=0).tolist() == pytest.approx([6.0, 0.0])


def test_effect_of_an_event_is_reported_for_its_object():
    events = [
        spawn_event(0, "bin", 9, 9),
        [1, "event.started", "crate falls", {}],
        spawn_event(1, "crate", 3, 0),
        [1, "event.ended", "crate falls", {}],
        [2, "event.started", "cart comes", {}],
        [2, "object.moved", "crate", {}],
        [2, "event.ended", "cart comes", {}],
    ]
    trace = synthetic_trace({"seconds": 10, "truth": [[0, 0, 0]], "events": events})
    assert [found.describe(trace) for found in movable_objects(trace, 300)] == [
        "bin",
        "crate (spawned by event `crate falls` at t = 1.00 s)",
    ]
    assert [found.describe(trace) for found in movable_objects(trace, 480)][1:] == [
        "crate (moved by event `cart comes` at t = 2.00 s)"
    ]


def test_object_above_the_robot_is_no_obstacle():
    assert objects_at([spawn_event(0, "lamp", 0, 0, parts=[])], 1) == []


def test_replacing_object_has_its_own_pose():
    events = [spawn_event(0, "cart", 0, 0), spawn_event(6, "cart", 5, 0)]
    path = {"cart": [[0, 0, 0], [6, 0, 0], [6.025, 5, 0], [10, 5, 0]]}
    assert [objects_at(events, at, objects=path)[0].outlines[0].mean(axis=0)[0] for at in (5.9, 6, 7)] == [0, 5, 5]
