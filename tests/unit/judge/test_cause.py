"""Why a finding failed, from sketched traces: each cause where it is known, and nothing where nothing is."""

import pytest

from simscen.core.verdict import Finding, Status, Verdict
from simscen.judge.cause import causes, explained
from simscen.judge.sketch import sketch, sketch_case

GOAL = {"name": "study", "pose": [8, 0, 0]}
DOOR = ["study", [5, 0.5], [5, -0.5], "west wall", "east wall"]
CASE = {
    "goals": [GOAL],
    "passages": [DOOR],
    "inscribed_radius": 0.2,
    "footprint": [[0.3, 0.2], [-0.3, 0.2], [-0.3, -0.2]],
}
STANDS = {"seconds": 10, "truth": [[0, 0, 0], [4, 4, 0], [10, 4, 0]]}
REFUSED = [[0, "goal.accepted", "study"], [10, "goal.failed", "study", {"error_name": "NO_VALID_PATH"}]]


def box(at, name, x, y, length, width, event=""):
    half, side = length / 2, width / 2
    corners = [[-half, -side], [half, -side], [half, side], [-half, side]]
    spawned = [at, "object.spawned", name, {"x": x, "y": y, "yaw": 0.0, "parts": [corners]}]
    return by(event, at, spawned) if event else [spawned]


def by(event, at, *what):
    effects = [{"happened": True, "what": "something"}]
    started, ended = [at, "event.started", event, {"entry": 0}], [at, "event.ended", event, {"effects": effects}]
    return [started, *what, ended]


def why(criterion, events, at=10, trace=STANDS, case=CASE, **changes):
    built = sketch({**trace, "events": [*REFUSED, *events], **changes})
    return causes(criterion, round(at * 240), built, sketch_case(case))


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


def test_a_thing_on_the_goal_is_named_once():
    assert why("goals_reached", box(1, "pallet", 8, 0, 1, 1, "pallet falls")) == [
        "why: pallet (spawned by event `pallet falls` at t = 1.00 s) stands on goal study"
    ]
    (line,) = why("goals_reached", box(1, "pallet", 8, 0.6, 1, 1, "pallet falls"))
    assert "stands 0.10 m from the middle of goal study" in line


def test_a_world_without_a_way_is_named():
    assert why("result", [], case={**CASE, "shortest": {"study": float("inf")}}) == [
        "why: the world itself leaves a robot of 0.40 m no way to goal study"
    ]


def test_what_the_robot_stands_at_is_named():
    (line,) = why("stuck", box(1, "crate", 4.6, 0, 0.4, 0.4, "crate falls"), case={**CASE, "passages": []})
    assert line == "why: crate (spawned by event `crate falls` at t = 1.00 s) was 0.20 m from the robot"


HIT = [2, "collision.started", "crate", {"robot_caused": True}]


def test_what_was_put_before_the_robot_and_struck_is_named_with_its_distance():
    lines = why("collisions", [*box(1.5, "crate", 2, 0, 0.4, 0.4, "crate falls"), HIT], at=2)
    assert lines == ["why: crate: event `crate falls` had put it 0.30 m from the robot's middle 0.50 s before"]


def test_what_ran_into_the_robot_is_told_with_its_speed():
    moved = by("cart comes", 1, [1, "object.moved", "crate", {}])
    hit = [*HIT[:3], {"robot_caused": False}]
    way = {"crate": [[0, 2, 4], [1, 2, 4], [2, 2, 0.5], [10, 2, 0.5]]}
    assert why("collisions", [*box(0, "crate", 2, 4, 0.4, 0.4), *moved, hit], at=2, objects=way) == [
        "why: crate: event `cart comes` had moved it 1.00 s before, it moved at 3.50 m/s, and ran into the robot"
    ]
    assert why("collisions", [*box(0, "crate", 2, 0, 0.4, 0.4), HIT], at=2) == []


def test_a_robot_that_was_set_down_elsewhere_is_lost_for_that_reason():
    events = by("carried off", 6, [6, "robot.placed", "", {}])
    far = {"belief": {"offset": [2.0, 0, 0]}}
    case = {"goals": [GOAL]}
    assert why("goals_reached", events, case=case, **far) == [
        "why: it believed itself 2.00 m from where it was",
        "why: event `carried off` had set it down elsewhere 4.00 s before",
    ]
    assert why("localization_error", events, case=case, **far) == [
        "why: event `carried off` had set it down elsewhere 4.00 s before"
    ]
    assert why("localization_error", events, case=case) == [
        "meanwhile: event `carried off` came 4.00 s before: something"
    ]


def slip(begin, felt, end=None, name="odom.slip", kind="slip"):
    told = [
        [begin, "fault.started", name, {"entry": 0, "fault": kind}],
        [felt, "fault.took_effect", name, {"entry": 0}],
    ]
    return [*told, *([[end, "fault.ended", name, {"entry": 0}]] if end else [])]


def test_an_odometry_fault_leads_astray_long_after_it_is_over():
    lost = {"case": {"goals": [GOAL]}, "belief": {"offset": [0, 0.8, 0]}}
    assert why("localization_error", slip(1, 1.5, 2), **lost) == [
        "why: odom.slip falsified its odometry from t = 1.50 s on"
    ]
    assert why("localization_error", slip(1, 1.5, 2, "lidar.off", "off"), **lost) == []


@pytest.mark.parametrize(
    ("events", "told"),
    [
        (slip(2, 2, name="lidar.off", kind="off"), ["lidar.off was at work since t = 2.00 s, for 8.00 s"]),
        (slip(0, 0, name="lidar.off", kind="off"), ["lidar.off was at work since the start, for 10.00 s"]),
        (slip(2, 2, 8, "lidar.off", "off"), ["lidar.off had ended 2.00 s before, after 6.00 s"]),
        (slip(2, 2, 6.5, "lidar.off", "off"), []),
        ([[2, "fault.started", "lidar.off", {"entry": 0}]], []),
        (by("gust", 6), ["event `gust` came 4.00 s before: something"]),
        (by("gust", 4), []),
    ],
)
def test_what_was_under_way_or_just_over_is_told_of_any_criterion(events, told):
    assert why("speed", events, case={}) == [f"meanwhile: {text}" for text in told]


def test_only_failures_are_explained_and_before_their_own_details():
    trace = sketch({**STANDS, "events": by("gust", 9)})
    failed = Finding(Status.FAIL, "speed", "2", "≤ 1", tick=2400, detail=("own",))
    findings = (failed, Finding(Status.PASS, "speed", "0", "≤ 1", tick=2400), Finding(Status.FAIL, "speed", "2", "≤ 1"))
    (verdict,) = explained([Verdict("speed", "speed", "fail", findings)], trace, sketch_case({}))
    assert [finding.detail for finding in verdict.findings] == [
        ("meanwhile: event `gust` came 1.00 s before: something", "own"),
        (),
        (),
    ]
