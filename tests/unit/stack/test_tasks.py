"""Tests of tasks: goals that are accepted, passed, reached, failed, and canceled as in Nav2's actions."""

from dataclasses import replace

import pytest

from simscen.core.clock import Clock
from simscen.core.geometry import Pose2
from simscen.core.messages.goals import Goal, loop_goal_name, matches_goal_name
from simscen.core.messages.navigation import ErrorCode, error_code
from simscen.core.records.events import Event
from simscen.stack.tasks import Task

A, B = Goal("a", Pose2(0, 0), via=True), Goal("b", Pose2(1, 0), via=True)
C, D = Goal("c", Pose2(2, 0)), Goal("d", Pose2(3, 0))


class Client:
    """Client that calls the methods of a task, records the returned events, and returns the current goal."""

    def __init__(self, task: Task) -> None:
        self.task, self.journal = task, list[Event]()

    def __getattr__(self, name: str):
        attribute = getattr(self.task, name)
        return (lambda *args: self._record(attribute(*args))) if callable(attribute) else attribute

    def _record(self, events: tuple[Event, ...]) -> Goal | None:
        self.journal += events
        return self.task.goal


def start_task(*goals: Goal, stop: bool = True, mode="navigate_to_pose") -> tuple[Client, list[Event]]:
    """Return the client of a started task, and the list in which the client records the events."""
    task_to_run = Task(stop, clock=Clock(100), mode=mode)
    task_to_run.start(goals)
    client = Client(task_to_run)
    return client, client.journal


def text(journal: list[Event]) -> list[tuple[int, str, str]]:
    return [(event.tick, event.kind.value, event.name) for event in journal]


def test_via_poses_are_passed_before_the_goal_is_reached():
    client, journal = start_task(A, B, C)
    assert client.accept_next(1) is A
    assert client.remaining_in_action == (B, C)
    client.record_passed(2)
    assert client.accept_next(2) is B
    client.record_passed(3)
    assert client.accept_next(3) is C
    assert client.remaining_in_action == ()
    client.record_reached(9)
    assert text(journal)[-3:] == [
        (3, "goal.accepted", "c"),
        (9, "goal.reached", "c"),
        (9, "navigation.ended", "SUCCEEDED"),
    ]
    assert [event.data["index"] for event in journal[:-1]] == [0, 0, 1, 1, 2, 2]


def test_failed_via_pose_fails_the_goal_of_its_action_and_the_next_action_starts():
    client, journal = start_task(A, B, C, D, stop=False)
    client.accept_next(1)
    client.record_passed(2)
    client.accept_next(2)
    client.record_failed(5, ErrorCode.NO_VALID_PATH, "no way")
    assert client.accept_next(6) is D
    client.record_reached(7)
    assert text(journal)[3:] == [
        (5, "goal.failed", "b"),
        (5, "goal.failed", "c"),
        (6, "goal.accepted", "d"),
        (7, "goal.reached", "d"),
        (7, "navigation.ended", "FAILED"),
    ]
    assert [event.data["index"] for event in journal[3:7]] == [1, 2, 3, 3]


@pytest.mark.parametrize("end", ["preempt", "cancel"])
def test_preempted_or_canceled_action_cancels_all_its_poses(end):
    client, journal = start_task(A, B, C, D)
    client.accept_next(1)
    client.preempt(2, Goal("x", Pose2(5, 5))) if end == "preempt" else client.cancel(2)
    assert [(kind, name) for _, kind, name in text(journal)[1:4]] == [("goal.canceled", name) for name in "abc"]
    if end == "preempt":
        assert {event.data["preempted_by"] for event in journal[1:4]} == {"x"}
        goal = client.accept_next(3)
        assert goal is not None
        assert goal.name == "x"
        client.record_reached(4)
        assert client.accept_next(5) is D
    else:
        assert text(journal)[-1] == (2, "navigation.ended", "CANCELED")


def test_robot_waits_for_the_duration_at_each_goal():
    goals = Goal("a", Pose2(0, 0), wait=0.5), Goal("b", Pose2(1, 0), wait=0.2)
    client, journal = start_task(*goals)
    client.accept_next(1)
    client.record_reached(10)
    assert client.accept_next(59) is None
    assert client.goal is None
    assert client.accept_next(60) is goals[1]
    client.record_reached(70)
    assert client.accept_next(89) is None
    assert text(journal)[-1] == (70, "goal.reached", "b")
    assert client.accept_next(90) is None
    assert text(journal)[-1] == (90, "navigation.ended", "SUCCEEDED")
    assert client.accept_next(91) is None
    assert len(journal) == 5


def test_wait_ends_when_the_task_is_canceled_or_preempted():
    goal = Goal("a", Pose2(0, 0), wait=5.0)
    canceled, journal = start_task(goal, D)
    canceled.accept_next(1)
    canceled.record_reached(2)
    canceled.cancel(3)
    assert text(journal)[-1] == (3, "navigation.ended", "CANCELED")
    assert canceled.accept_next(1000) is None
    preempted, journal = start_task(goal, D)
    preempted.accept_next(1)
    preempted.record_reached(2)
    preempted.preempt(3, C)
    assert preempted.accept_next(3) is C
    preempted.record_reached(4)
    assert preempted.accept_next(4) is D


def test_cancel_ends_a_task_whose_next_goal_is_not_accepted_yet():
    canceled, journal = start_task(C, D)
    canceled.cancel(1)
    assert text(journal) == [(1, "navigation.ended", "CANCELED")]
    assert canceled.accept_next(1) is None
    preempted, journal = start_task(C)
    preempted.accept_next(1)
    preempted.preempt(2, D)
    preempted.cancel(2)
    assert text(journal)[-1] == (2, "navigation.ended", "CANCELED")
    assert preempted.accept_next(2) is None


def test_canceled_task_ends_as_canceled_after_an_earlier_failure():
    client, journal = start_task(C, D, stop=False)
    client.accept_next(1)
    client.record_failed(2, ErrorCode.NO_VALID_PATH, "no way")
    client.accept_next(3)
    client.cancel(4)
    assert text(journal)[-1] == (4, "navigation.ended", "CANCELED")
    assert journal[-1].data["error_name"] == "NONE"


@pytest.mark.parametrize(
    ("mode", "stop", "code"),
    [
        ("follow_waypoints", True, ErrorCode.STOP_ON_MISSED_WAYPOINT),
        ("follow_waypoints", False, ErrorCode.NO_VALID_PATH),
        ("navigate_to_pose", True, ErrorCode.NO_VALID_PATH),
    ],
)
def test_stopped_waypoint_follower_reports_the_missed_waypoint(mode, stop, code):
    client, journal = start_task(C, stop=stop, mode=mode)
    client.accept_next(1)
    client.record_failed(2, ErrorCode.NO_VALID_PATH, "no way")
    assert journal[-2].data["error_name"] == "NO_VALID_PATH"  # code of the goal
    assert journal[-1].data == {"error_code": int(code), "error_name": code.name}


def test_goal_name_has_the_number_of_its_loop_and_matches_the_plain_name():
    assert [loop_goal_name("shelf", loop) for loop in (1, 2, 12)] == ["shelf", "shelf#2", "shelf#12"]
    assert matches_goal_name("shelf#2", "shelf")
    assert matches_goal_name("shelf#2", "shelf#2")
    assert matches_goal_name("shelf", None)
    assert not matches_goal_name("shelf", "shelf#2")
    assert not matches_goal_name("shelf#2", "shelf#3")
    assert not matches_goal_name("shelf#b", "shelf")
    assert not matches_goal_name("bookshelf#2", "shelf")


def test_error_codes_of_actions_through_poses_have_the_names_of_actions_to_one_pose():
    assert error_code(306) is ErrorCode.GOAL_OCCUPIED  # nav2_msgs/action/ComputePathThroughPoses
    assert error_code(9103) is ErrorCode.NAVIGATE_TIMEOUT  # nav2_msgs/action/NavigateThroughPoses
    assert error_code(309) is ErrorCode.NO_VIAPOINTS_GIVEN
    assert error_code(603) is ErrorCode.STOP_ON_MISSED_WAYPOINT
    assert error_code(4711) == 4711


def test_goal_in_another_frame_differs_only_in_its_pose() -> None:
    goal = Goal("there", Pose2(1, 2, 3), 0.1, 0.2, 30.0, True, 4.0)
    assert goal.at(Pose2(5, 6, 7)) == replace(goal, pose=Pose2(5, 6, 7))


def test_task_refuses_a_mutable_list_of_goals():
    with pytest.raises(TypeError):
        Task(True, [])
    task = Task(True)
    task.start((Goal("a", Pose2(1, 0)),))
    assert [event.kind for event in task.accept_next(0)] == ["goal.accepted"]
