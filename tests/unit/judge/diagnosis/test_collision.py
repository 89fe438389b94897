"""Tests of the diagnosis of collisions."""

from diagnosis_cases import box, why, with_event

CONTACT = [2, "collision.started", "crate", {"robot_caused": True}]


def test_spawned_object_is_reported_with_its_distance():
    lines = why("collisions", [*box(1.5, "crate", 2, 0, 0.4, 0.4, "crate falls"), CONTACT], at=2)
    assert lines == ["why: crate: event `crate falls` had spawned it 0.30 m from the robot's center 0.50 s before"]


def test_object_that_hit_the_robot_is_reported_with_its_speed():
    moved = with_event("cart comes", 1, [1, "object.moved", "crate", {}])
    hit = [*CONTACT[:3], {"robot_caused": False}]
    trajectory = {"crate": [[0, 2, 4], [1, 2, 4], [2, 2, 0.5], [10, 2, 0.5]]}
    assert why("collisions", [*box(0, "crate", 2, 4, 0.4, 0.4), *moved, hit], at=2, objects=trajectory) == [
        "why: crate: event `cart comes` had moved it 1.00 s before, it moved at 3.50 m/s, and ran into the robot"
    ]
    assert why("collisions", [*box(0, "crate", 2, 0, 0.4, 0.4), CONTACT], at=2) == []


def test_object_faster_than_6_cm_per_second_is_moving():
    crate = [*box(0, "crate", 2, 0, 0.4, 0.4), CONTACT]
    slow, still = (
        {"crate": [[0, 2, 0], [2, 2 + 2 * speed, 0], [10, 2 + 2 * speed, 0]]} for speed in (0.0625, 0.0546875)
    )
    assert why("collisions", crate, at=2, objects=slow) == ["why: crate: it moved at 0.06 m/s"]
    assert why("collisions", crate, at=2, objects=still) == []


def test_teleportation_of_an_object_is_not_a_speed():
    """The sample at the tick of the event still has the earlier pose."""
    placed = with_event("crate jumps", 1.9, [1.9, "object.placed", "crate", {}])
    hit = [*CONTACT[:3], {"robot_caused": False}]
    trajectory = {"crate": [[0, 2, 4], [1.9, 2, 4], [1.901, 2, 0.3], [10, 2, 0.3]]}
    assert why("collisions", [*box(0, "crate", 2, 4, 0.4, 0.4), *placed, hit], at=2, objects=trajectory) == [
        "why: crate: event `crate jumps` had moved it 0.10 s before, and ran into the robot"
    ]


def test_speed_is_averaged_from_the_first_sample_after_a_teleportation():
    placed = with_event("crate jumps", 1.9, [1.9, "object.placed", "crate", {}])
    fast_at_first = {"crate": [[0, 2, 4], [1.9, 2, 4], [1.925, 2.0, 0.3], [1.95, 2.1, 0.3], [2, 2.15, 0.3]]}
    assert why("collisions", [*box(0, "crate", 2, 4, 0.4, 0.4), *placed, CONTACT], at=2, objects=fast_at_first) == [
        "why: crate: event `crate jumps` had moved it 0.10 s before, it moved at 2.00 m/s"
    ]


def test_object_without_a_sample_between_its_teleportation_and_the_contact_has_no_speed():
    placed = with_event("crate jumps", 1.985, [1.985, "object.placed", "crate", {}])
    trajectory = {"crate": [[0, 2, 4], [1.985, 2, 4], [2, 2, 0.3]]}
    assert why("collisions", [*box(0, "crate", 2, 4, 0.4, 0.4), *placed, CONTACT], at=2, objects=trajectory) == [
        "why: crate: event `crate jumps` had moved it 0.02 s before"
    ]


def test_event_that_pushed_the_object_is_named():
    pushed = with_event("crate slides", 1, [1, "object.pushed", "crate", {"impulse": [0, -50]}])
    trajectory = {"crate": [[0, 2, 4], [1, 2, 4], [2, 2, 0.5], [10, 2, 0.5]]}
    assert why("collisions", [*box(0, "crate", 2, 4, 0.4, 0.4), *pushed, CONTACT], at=2, objects=trajectory) == [
        "why: crate: event `crate slides` had moved it 1.00 s before, it moved at 3.50 m/s"
    ]
