"""Tests of the diagnosis of blocked paths."""

from dataclasses import dataclass

import numpy as np
import pytest
from diagnosis_cases import CASE, DOOR, STATIONARY, box, why, with_event

from simscen.judge.blocked_path import diagnose_blocked_path
from simscen.judge.movable_objects import MovableObject, movable_objects
from simscen.testing.synthetic_trace import synthetic_case, synthetic_trace

CLOSES = (
    "why: crate (spawned by event `crate falls` at t = 1.00 s) closes the passage of 1.00 m between `west wall` and "
    "`east wall` at (5.00, 0.00) on the shortest path: {}, the robot is 0.40 m wide"
)


@pytest.mark.parametrize("criterion", ["goals_reached", "result", "error_code", "time_to_goal", "stuck"])
def test_object_without_space_for_the_disc_closes_the_passage(criterion):
    assert why(criterion, box(1, "crate", 5, 0, 0.6, 0.9, "crate falls")) == [CLOSES.format("0.05 m are left")]
    assert why(criterion, box(1, "crate", 5, 0, 0.6, 2.0, "crate falls")) == [CLOSES.format("nothing is left")]


def test_object_beside_the_line_can_close_the_passage():
    assert why("result", box(1, "crate", 5.2, 0, 0.2, 1.0, "crate falls")) == [CLOSES.format("0.20 m are left")]


def test_object_without_space_to_turn_narrows_the_passage():
    (line,) = why("result", box(1, "crate", 5, -0.5, 0.6, 1.1, "crate falls"))
    assert "narrows the passage of 1.00 m" in line
    assert "0.45 m are left" in line


def test_two_objects_that_close_the_passage_together_are_both_named():
    (line,) = why("result", [*box(1, "a", 5, 0.4, 0.6, 0.4, "first"), *box(2, "b", 5, -0.4, 0.6, 0.4, "second")])
    assert line.startswith("why: a (spawned by event `first` at t = 1.00 s) and b (spawned by event `second` at")
    assert "close the passage" in line


@pytest.mark.parametrize(
    "events",
    [
        [],
        box(1, "crate", 5, 5, 0.6, 0.9, "crate falls"),
        [*box(1, "crate", 5, 0, 0.6, 0.9, "crate falls"), *with_event("", 2, [2, "object.removed", "crate", {}])],
        box(1, "crate", 2, 0, 0.6, 0.9, "crate falls"),
    ],
)
def test_object_outside_the_passage_is_not_reported(events):
    assert why("goals_reached", events) == []


def test_passage_behind_the_robot_is_not_a_cause():
    case = {**CASE, "passages": [["study", [3.9, 0.5], [3.9, -0.5], "a", "b"], DOOR]}
    crate = box(1, "crate", 3.2, 0, 0.2, 1.0, "crate falls")
    assert why("result", box(1, "crate", 3.9, 0, 0.2, 1.0, "crate falls"), case={**case, "inscribed_radius": 0.05}) == [
        "why: crate (spawned by event `crate falls` at t = 1.00 s) was 0.00 m from the robot"
    ]
    assert why("result", crate, case=case) == []


def test_moved_object_counts_at_its_current_pose():
    moved = with_event("cart comes", 3, [3, "object.moved", "cart", {}])
    (line,) = why(
        "goals_reached", [*box(0, "cart", 5, 9, 0.6, 1.2), *moved], objects={"cart": [[0, 5, 9], [3, 5, 9], [5, 5, 0]]}
    )
    assert line.startswith("why: cart (moved by event `cart comes` at t = 3.00 s) closes the passage")
    assert why("result", [*box(0, "cart", 5, 0, 0.6, 1.2)])[0].startswith("why: cart closes the passage")


def test_object_with_space_to_turn_is_not_reported():
    assert why("result", box(1, "crate", 5, -0.5, 0.2, 0.4, "crate falls")) == []
    tight = {**CASE, "passages": [["study", [5, 0.25], [5, -0.25], "west wall", "east wall"]]}
    assert why("result", [], case=tight) == []
    assert why("result", box(1, "crate", 5, 5, 0.2, 0.4, "crate falls"), case=tight) == []


def test_tightest_closed_passage_is_reported():
    wider = ["study", [6, 0.9], [6, -0.9], "a", "b"]
    events = [*box(1, "crate", 5, 0, 0.2, 0.9, "crate falls"), *box(1, "shelf", 6, 0, 0.2, 1.5, "shelf falls")]
    (line,) = why("result", events, case={**CASE, "passages": [wider, DOOR]})
    assert line.startswith("why: crate")
    assert "1.00 m between `west wall`" in line


def test_three_centimeters_of_free_space_are_reported():
    (line,) = why("result", box(1, "crate", 5, 0, 0.6, 0.94, "crate falls"))
    assert "0.03 m are left" in line


def test_robot_off_the_path_has_not_passed_any_passage():
    case = {**CASE, "passages": [["study", [3.4, 0.5], [3.4, -0.5], "a", "b"], DOOR]}
    crate = box(1, "crate", 3.4, 0, 0.1, 2.0, "crate falls")
    assert why("result", crate, case=case)[0].startswith(
        "why: crate (spawned by event `crate falls` at t = 1.00 s) closes"
    )
    near = {**CASE, "passages": [["study", [3.6, 0.5], [3.6, -0.5], "a", "b"], DOOR], "inscribed_radius": 0.01}
    assert "closes" not in "".join(why("result", box(1, "crate", 3.6, 0, 0.1, 2.0, "crate falls"), case=near))


def doors(*at):
    return {**CASE, "passages": [["study", [x, 0.5], [x, -0.5], "a", "b"] for x in at]}


@pytest.mark.parametrize(
    ("at", "case", "is_reported"),
    [
        (3.0, doors(3.0, 3.9, 5.0, 6.0), False),
        (3.9, doors(3.0, 3.9, 5.0, 6.0), False),
        (5.0, doors(3.0, 3.9, 5.0, 6.0), True),
        (6.0, doors(3.0, 3.9, 5.0, 6.0), True),
        (4.1, doors(3.0, 4.1, 5.0, 6.0), True),
        (3.0, doors(3.0, 4.1, 5.0, 6.0), False),
        (4.0, doors(3.0, 4.0, 5.0), True),
        (3.5, doors(3.5, 5.0), False),
        (3.49, doors(3.49, 5.0), True),
        (3.9, doors(3.9), True),
    ],
)
def test_only_passages_ahead_of_the_robot_count(at, case, is_reported):
    lines = why("result", box(1, "crate", at, 0, 0.02, 2.0), case=case)
    assert any("closes" in line for line in lines) is is_reported


def test_collinear_passage_is_not_counted_as_passed():
    case = {**CASE, "passages": [["study", [3.9, 0.5], [3.9, -0.5], "a", "b"], ["study", [3.9, 3], [3.9, 2], "a", "b"]]}
    assert "closes" in why("result", box(1, "crate", 3.9, 0, 0.02, 2.0), case=case)[0]


def test_long_robot_needs_more_space_to_turn():
    long = {**CASE, "footprint": [[0.1, 0.2], [-0.6, 0.2], [-0.6, -0.2], [0.1, -0.2]]}
    (line,) = why("result", box(1, "crate", 5, -0.5, 0.6, 1.1), case=long)
    assert "0.45 m are left" in line


def test_remaining_gap_of_two_centimeters_and_gap_at_the_wall_are_found():
    assert "0.02 m are left" in why("result", box(1, "crate", 5, 0, 0.6, 0.95))[0]
    assert "0.10 m are left" in why("result", box(1, "crate", 5, -0.3, 0.6, 1.4))[0]


@dataclass(frozen=True)
class Fog(MovableObject):
    """Object at the same distance from every point."""

    near: float = 0.0

    def distance(self, points):
        return np.full(len(points), self.near)


def blocked_path_text(*objects, **changes):
    fogs = [Fog(name, (), "", 0, False, near) for name, near in objects]
    lines, _ = diagnose_blocked_path(synthetic_trace(STATIONARY), synthetic_case(CASE | changes), "study", 2400, fogs)
    return " ".join(lines)


def blocking_text(*objects, **changes):
    return blocked_path_text(*objects, **changes).split(" the passage")[0]


def test_gap_as_wide_as_the_robot_narrows_and_gap_to_turn_in_is_not_reported():
    assert blocking_text(("fog", 0.2)) == "fog narrows"
    assert blocking_text(("fog", 0.199)) == "fog closes"
    assert blocking_text(("fog", 0.2), footprint=[]) == ""


def test_remaining_gap_is_reported_from_two_centimeters():
    assert "the shortest path: 0.02 m are left" in blocked_path_text(("fog", 0.01))
    assert "the shortest path: nothing is left" in blocked_path_text(("fog", 0.0099))


def test_passage_narrowed_by_less_than_two_centimeters_is_not_reported():
    assert blocking_text(("fog", 0.49), footprint=[[0.6, 0.8]]) == ""
    assert blocking_text(("fog", 0.48), footprint=[[0.6, 0.8]]) == "fog narrows"


def test_last_closing_object_is_named():
    assert blocking_text(("a", 0.1), ("b", 0.1), ("c", 0.1)) == "c closes"
    assert blocking_text(("a", 0.1), ("b", 0.2)) == "a closes"
    assert blocking_text(("a", 0.25), ("b", 0.4)) == "a narrows"


def test_uninvolved_object_is_not_named():
    trace = synthetic_trace({**STATIONARY, "events": [*box(1, "a", 5, 0.4, 0.6, 0.4), *box(2, "b", 5, -0.4, 0.6, 0.4)]})
    fogs = [Fog("haze", (), "", 0, False, 0.49), Fog("mist", (), "", 0, False, 0.6)]
    (line,), _ = diagnose_blocked_path(
        trace, synthetic_case(CASE), "study", 2400, [*movable_objects(trace, 2400), *fogs]
    )
    assert line.startswith("a and b close the passage")
