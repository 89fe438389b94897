"""What closes the way, and nothing else."""

import pytest
from whys import CASE, DOOR, box, by, why

CLOSES = (
    "why: crate (spawned by event `crate falls` at t = 1.00 s) closes the passage of 1.00 m between `west wall` and "
    "`east wall` at (5.00, 0.00) on the shortest way: {}, the robot is 0.40 m wide"
)


@pytest.mark.parametrize("criterion", ["goals_reached", "result", "error_code", "time_to_goal", "stuck"])
def test_a_thing_that_leaves_no_disc_room_closes_the_passage(criterion):
    assert why(criterion, box(1, "crate", 5, 0, 0.6, 0.9, "crate falls")) == [CLOSES.format("0.05 m are left")]
    assert why(criterion, box(1, "crate", 5, 0, 0.6, 2.0, "crate falls")) == [CLOSES.format("nothing is left")]


def test_a_thing_beside_the_line_closes_it_too_when_nothing_fits_past():
    assert why("result", box(1, "crate", 5.2, 0, 0.2, 1.0, "crate falls")) == [CLOSES.format("0.20 m are left")]


def test_what_leaves_room_for_the_robot_but_not_to_turn_narrows():
    (line,) = why("result", box(1, "crate", 5, -0.5, 0.6, 1.1, "crate falls"))
    assert "narrows the passage of 1.00 m" in line
    assert "0.45 m are left" in line


def test_two_things_that_only_together_close_it_are_both_named():
    (line,) = why("result", [*box(1, "a", 5, 0.4, 0.6, 0.4, "first"), *box(2, "b", 5, -0.4, 0.6, 0.4, "second")])
    assert line.startswith("why: a (spawned by event `first` at t = 1.00 s) and b (spawned by event `second` at")
    assert "close the passage" in line


@pytest.mark.parametrize(
    "events",
    [
        [],
        box(1, "crate", 5, 5, 0.6, 0.9, "crate falls"),
        [*box(1, "crate", 5, 0, 0.6, 0.9, "crate falls"), *by("", 2, [2, "object.removed", "crate", {}])],
        box(1, "crate", 2, 0, 0.6, 0.9, "crate falls"),
    ],
)
def test_nothing_is_said_of_what_is_not_in_the_way(events):
    assert why("goals_reached", events) == []


def test_a_passage_that_the_robot_has_passed_does_not_keep_it():
    case = {**CASE, "passages": [["study", [3.9, 0.5], [3.9, -0.5], "a", "b"], DOOR]}
    crate = box(1, "crate", 3.2, 0, 0.2, 1.0, "crate falls")
    assert why("result", box(1, "crate", 3.9, 0, 0.2, 1.0, "crate falls"), case={**case, "inscribed_radius": 0.05}) == [
        "why: crate (spawned by event `crate falls` at t = 1.00 s) was 0.00 m from the robot"
    ]
    assert why("result", crate, case=case) == []


def test_a_thing_that_moved_counts_where_it_is_now():
    moved = by("cart comes", 3, [3, "object.moved", "cart", {}])
    (line,) = why(
        "goals_reached", [*box(0, "cart", 5, 9, 0.6, 1.2), *moved], objects={"cart": [[0, 5, 9], [3, 5, 9], [5, 5, 0]]}
    )
    assert line.startswith("why: cart (moved by event `cart comes` at t = 3.00 s) closes the passage")
    assert why("result", [*box(0, "cart", 5, 0, 0.6, 1.2)])[0].startswith("why: cart closes the passage")


def test_what_leaves_room_to_turn_is_not_in_the_way_and_a_passage_as_it_is_never_is():
    assert why("result", box(1, "crate", 5, -0.5, 0.2, 0.4, "crate falls")) == []
    tight = {**CASE, "passages": [["study", [5, 0.25], [5, -0.25], "west wall", "east wall"]]}
    assert why("result", [], case=tight) == []
    assert why("result", box(1, "crate", 5, 5, 0.2, 0.4, "crate falls"), case=tight) == []


def test_of_several_closed_passages_the_tightest_is_told():
    wider = ["study", [6, 0.9], [6, -0.9], "a", "b"]
    events = [*box(1, "crate", 5, 0, 0.2, 0.9, "crate falls"), *box(1, "shelf", 6, 0, 0.2, 1.5, "shelf falls")]
    (line,) = why("result", events, case={**CASE, "passages": [wider, DOOR]})
    assert line.startswith("why: crate")
    assert "1.00 m between `west wall`" in line


def test_three_centimetres_are_not_nothing():
    (line,) = why("result", box(1, "crate", 5, 0, 0.6, 0.94, "crate falls"))
    assert "0.03 m are left" in line


def test_a_robot_off_the_way_has_all_passages_before_it():
    case = {**CASE, "passages": [["study", [3.4, 0.5], [3.4, -0.5], "a", "b"], DOOR]}
    crate = box(1, "crate", 3.4, 0, 0.1, 2.0, "crate falls")
    assert why("result", crate, case=case)[0].startswith(
        "why: crate (spawned by event `crate falls` at t = 1.00 s) closes"
    )
    near = {**CASE, "passages": [["study", [3.6, 0.5], [3.6, -0.5], "a", "b"], DOOR], "inscribed_radius": 0.01}
    assert "closes" not in "".join(why("result", box(1, "crate", 3.6, 0, 0.1, 2.0, "crate falls"), case=near))
