"""Tests of the diagnosis of failed goals."""

import pytest
from diagnosis_cases import CASE, STATIONARY, box, why

from simscen.judge.failure_causes import causes
from simscen.testing.synthetic_trace import synthetic_case, synthetic_trace


def test_object_on_the_goal_is_named_once():
    assert why("goals_reached", box(1, "pallet", 8, 0, 1, 1, "pallet falls")) == [
        "why: pallet (spawned by event `pallet falls` at t = 1.00 s) stands on goal study"
    ]
    (line,) = why("goals_reached", box(1, "pallet", 8, 0.6, 1, 1, "pallet falls"))
    assert "stands 0.10 m from the center of goal study" in line


def test_unreachable_goal_is_explained_by_the_world():
    assert why("result", [], case={**CASE, "shortest": {"study": float("inf")}}) == [
        "why: the world has no path to goal study for a robot 0.40 m wide"
    ]


def test_touched_object_is_named():
    (line,) = why("stuck", box(1, "crate", 4.6, 0, 0.4, 0.4, "crate falls"), case={**CASE, "passages": []})
    assert line == "why: crate (spawned by event `crate falls` at t = 1.00 s) was 0.20 m from the robot"


def test_unreachable_goal_names_the_passage_that_is_too_narrow():
    gap = ["study", [5, 0.15], [5, -0.15], "west wall", "east wall"]
    (line,) = why("result", [], case={**CASE, "shortest": {"study": float("inf")}, "passages": [gap]})
    assert line.endswith(
        "a robot 0.40 m wide; the passage of 0.30 m between `west wall` and `east wall` at (5.00, 0.00) is too narrow"
    )


def test_current_contact_is_named_with_its_start():
    touches = [[3, "collision.started", "sill", {}], [4, "collision.ended", "sill", {}]]
    assert why("stuck", touches) == []
    assert why("stuck", [*touches, [6, "collision.started", "sill", {}]]) == [
        "why: the robot had touched sill since t = 6.00 s"
    ]
    assert why("stuck", [[6, "collision.started", "sill", {}]], at=5) == []


def test_blocking_object_is_reported_only_for_an_active_goal():
    crate = box(1, "crate", 5, 0, 0.6, 2.0, "crate falls")
    assert why("stuck", crate, at=9)
    reached = [[0, "goal.accepted", "study"], [8, "goal.reached", "study"]]
    built = synthetic_trace({**STATIONARY, "events": [*reached, *crate]})
    assert causes("stuck", 2160, built, synthetic_case(CASE)) == []
    assert causes("goals_reached", 1920, built, synthetic_case(CASE)) == []


def test_blocking_object_is_reported_after_the_goal_has_failed():
    crate = box(1, "crate", 5, 0, 0.6, 2.0, "crate falls")
    failed = [[0, "goal.accepted", "study"], [8, "goal.failed", "study", {}], *crate]
    built = synthetic_trace({**STATIONARY, "events": failed})
    assert len(causes("result", 2400, built, synthetic_case(CASE))) == 1


def test_closing_object_is_reported_once_with_other_near_objects():
    case = {**CASE, "passages": [["study", [4.6, 0.5], [4.6, -0.5], "a", "b"]]}
    crate = box(1, "crate", 4.6, 0, 0.4, 2.0, "crate falls")
    (line,) = why("result", crate, case=case)
    assert "closes" in line
    bin_ = box(2, "bin", 4, 0.4, 0.2, 0.2, "bin rolls")
    assert [line.split(" (")[0] for line in why("result", [*crate, *bin_], case=case)] == ["why: crate", "why: bin"]


def test_initial_objects_are_reported_next_to_others():
    case = {**CASE, "passages": [["study", [4.6, 0.5], [4.6, -0.5], "a", "b"]]}
    events = [*box(0, "door", 4.6, 0, 0.1, 2.0), *box(0, "bin", 4, 0.4, 0.2, 0.2)]
    assert [line.split()[1] for line in why("result", events, case=case)] == ["door", "bin"]


def test_object_beyond_thirty_centimeters_is_not_reported():
    assert why("stuck", box(1, "crate", 4.75, 0, 0.4, 0.4, "falls"), case={**CASE, "passages": []}) == []


@pytest.mark.parametrize(
    ("events", "at", "is_active"),
    [
        ([[3, "goal.accepted", "study"]], 3, True),
        ([[3, "goal.accepted", "study"]], 2.9, False),
        ([[0, "goal.accepted", "study"], [8, "goal.canceled", "study"]], 8, True),
        ([[0, "goal.accepted", "study"], [8, "goal.canceled", "study"]], 8.1, False),
        ([[0, "goal.accepted", "study"], [8, "goal.reached", "study"]], 7.9, True),
        ([[0, "goal.accepted", "study"], [8, "goal.failed", "study"]], 7.9, True),
        ([[0, "goal.accepted", "study"], [8, "goal.failed", "study"]], 8, True),
        ([[8, "goal.failed", "study"]], 8, True),
    ],
)
def test_goal_is_active_from_acceptance_to_its_result(events, at, is_active):
    built = synthetic_trace({**STATIONARY, "events": [*box(0, "crate", 5, 0, 0.6, 2.0), *events]})
    assert bool(causes("stuck", round(at * 240), built, synthetic_case(CASE))) is is_active


def test_object_on_an_earlier_goal_is_not_a_cause():
    goals = [{"name": "kitchen", "pose": [2, 3, 0]}, {"name": "study", "pose": [8, 0, 0]}]
    earlier = [[0, "goal.accepted", "kitchen"], [2, "goal.reached", "kitchen"], [2, "goal.accepted", "study"]]
    built = synthetic_trace({**STATIONARY, "events": [*earlier, *box(3, "crate", 2, 3, 1, 1)]})
    assert causes("stuck", 2400, built, synthetic_case({**CASE, "goals": goals})) == []


def test_passage_as_wide_as_the_robot_is_not_too_narrow():
    gap = ["study", [5, 0.2], [5, -0.2], "west wall", "east wall"]
    (line,) = why("result", [], case={**CASE, "shortest": {"study": float("inf")}, "passages": [gap]})
    assert line.endswith("path to goal study for a robot 0.40 m wide")


def test_contact_starting_at_the_tick_counts_and_ending_does_not():
    touches = [[6, "collision.started", "sill", {}], [8, "collision.ended", "sill", {}]]
    assert why("stuck", touches, at=6) == ["why: the robot had touched sill since t = 6.00 s"]
    assert why("stuck", touches, at=8) == []


def test_object_that_only_touches_the_goal_footprint_is_not_on_the_goal():
    assert why("stuck", box(0, "crate", 8, 0.75, 1, 1), case={**CASE, "inscribed_radius": 0.25}) == []


def test_object_within_thirty_centimeters_is_reported():
    (line,) = why("stuck", box(0, "crate", 4.7, 0, 0.4, 0.4), case={**CASE, "passages": []})
    assert line == "why: crate was 0.30 m from the robot"


def test_reason_for_waiting_of_the_stack_is_named():
    held = [2, "robot.held", "collision_monitor", {"message": "scans of lidar `lidar` come late"}]
    (line,) = why("goals_reached", [held])
    reason = "scans of lidar `lidar` come late"
    assert line == f"why: the collision monitor has stopped the robot, as reported at t = 2.00 s: {reason}"
    assert why("goals_reached", [held, [4, "robot.released", "collision_monitor"]]) == []


def test_message_of_the_stack_is_quoted_only_without_another_cause():
    given_up = [[0, "goal.accepted", "study"], [5, "recovery.started", "spin", {}], [6, "recovery.started", "wait", {}]]
    given_up.append([8, "goal.failed", "study", {"error_name": "PATIENCE_EXCEEDED", "message": "no room to turn"}])

    def causes_with(*events):
        trace = synthetic_trace({**STATIONARY, "events": [*given_up, *events]})
        return causes("result", 2400, trace, synthetic_case(CASE))

    assert causes_with() == ["why: the stack gave up and reported: no room to turn; spin, wait had not helped"]
    assert "said" not in "".join(causes_with(*box(1, "crate", 5, 0, 0.6, 2.0, "crate falls")))


def test_failed_recoveries_are_always_reported_with_their_codes():
    timeout = {"outcome": "failed", "error_code": 711, "error_name": "BACKUP_TIMEOUT", "message": "it took too long"}
    blocked = {"outcome": "failed", "error_code": 703, "error_name": "SPIN_COLLISION_AHEAD", "message": "no room"}
    tried = [
        [3, "recovery.ended", "wait", {"outcome": "succeeded"}],
        [4, "recovery.ended", "backup", timeout],
        [5, "recovery.ended", "spin", blocked],
        [6, "recovery.ended", "backup", timeout],
        [1000, "recovery.ended", "spin", blocked],
    ]
    (nearest, line) = why("stuck", [*tried, *box(0, "crate", 4.7, 0, 0.4, 0.4)], case={**CASE, "passages": []})
    assert nearest == "why: crate was 0.30 m from the robot"
    assert line == "why: recoveries failed: backup with BACKUP_TIMEOUT 2 times, spin with SPIN_COLLISION_AHEAD"
