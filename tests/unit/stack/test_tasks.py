"""Tests of the list of goals, as a client of Nav2's actions sees it."""

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
    """Does with a task what a stack does, and writes down what it hears."""

    def __init__(self, task: Task) -> None:
        self.task, self.journal = task, list[Event]()

    def __getattr__(self, name: str):
        what = getattr(self.task, name)
        return (lambda *args: self._heard(what(*args))) if callable(what) else what

    def _heard(self, events: tuple[Event, ...]) -> Goal | None:
        self.journal += events
        return self.task.goal


def task(*goals: Goal, stop: bool = True, mode="navigate_to_pose") -> tuple[Client, list[Event]]:
    begun = Task(stop, clock=Clock(100), mode=mode)
    begun.start(goals)
    client = Client(begun)
    return client, client.journal


def text(journal: list[Event]) -> list[tuple[int, str, str]]:
    return [(event.tick, event.kind.value, event.name) for event in journal]


def test_via_poses_are_passed_before_the_goal_is_reached():
    drive, journal = task(A, B, C)
    assert drive.accept_next(1) is A
    assert drive.remaining_in_action == (B, C)
    drive.record_passed(2)
    assert drive.accept_next(2) is B
    drive.record_passed(3)
    assert drive.accept_next(3) is C
    assert drive.remaining_in_action == ()
    drive.record_reached(9)
    assert text(journal)[-3:] == [
        (3, "goal.accepted", "c"),
        (9, "goal.reached", "c"),
        (9, "navigation.ended", "SUCCEEDED"),
    ]
    assert [event.data["index"] for event in journal[:-1]] == [0, 0, 1, 1, 2, 2]


def test_failed_drive_fails_all_its_poses_and_the_next_drive_starts():
    drive, journal = task(A, B, C, D, stop=False)
    drive.accept_next(1)
    drive.record_passed(2)
    drive.accept_next(2)
    drive.record_failed(5, ErrorCode.NO_VALID_PATH, "no way")
    assert drive.accept_next(6) is D
    drive.record_reached(7)
    assert text(journal)[3:] == [
        (5, "goal.failed", "b"),
        (5, "goal.failed", "c"),
        (6, "goal.accepted", "d"),
        (7, "goal.reached", "d"),
        (7, "navigation.ended", "FAILED"),
    ]
    assert [event.data["index"] for event in journal[3:7]] == [1, 2, 3, 3]


@pytest.mark.parametrize("how", ["preempt", "cancel"])
def test_end_of_a_drive_ends_all_its_goals(how):
    drive, journal = task(A, B, C, D)
    drive.accept_next(1)
    drive.preempt(2, Goal("x", Pose2(5, 5))) if how == "preempt" else drive.cancel(2)
    assert [(kind, name) for _, kind, name in text(journal)[1:4]] == [("goal.canceled", each) for each in "abc"]
    if how == "preempt":
        assert {event.data["preempted_by"] for event in journal[1:4]} == {"x"}
        goal = drive.accept_next(3)
        assert goal is not None
        assert goal.name == "x"
        drive.record_reached(4)
        assert drive.accept_next(5) is D
    else:
        assert text(journal)[-1] == (2, "navigation.ended", "CANCELED")


def test_robot_waits_for_the_duration_at_each_goal():
    waits = Goal("a", Pose2(0, 0), wait=0.5), Goal("b", Pose2(1, 0), wait=0.2)
    tour, journal = task(*waits)
    tour.accept_next(1)
    tour.record_reached(10)
    assert tour.accept_next(59) is None
    assert tour.goal is None
    assert tour.accept_next(60) is waits[1]
    tour.record_reached(70)
    assert tour.accept_next(89) is None
    assert text(journal)[-1] == (70, "goal.reached", "b")
    assert tour.accept_next(90) is None
    assert text(journal)[-1] == (90, "navigation.ended", "SUCCEEDED")
    assert tour.accept_next(91) is None
    assert len(journal) == 5


def test_a_wait_ends_when_the_task_is_canceled_or_another_goal_comes():
    stays = Goal("a", Pose2(0, 0), wait=5.0)
    canceled, journal = task(stays, D)
    canceled.accept_next(1)
    canceled.record_reached(2)
    canceled.cancel(3)
    assert text(journal)[-1] == (3, "navigation.ended", "CANCELED")
    assert canceled.accept_next(1000) is None
    preempted, journal = task(stays, D)
    preempted.accept_next(1)
    preempted.record_reached(2)
    preempted.preempt(3, C)
    assert preempted.accept_next(3) is C
    preempted.record_reached(4)
    assert preempted.accept_next(4) is D


def test_cancel_ends_a_task_whose_next_goal_is_not_accepted_yet():
    begun, journal = task(C, D)
    begun.cancel(1)
    assert text(journal) == [(1, "navigation.ended", "CANCELED")]
    assert begun.accept_next(1) is None
    preempted, journal = task(C)
    preempted.accept_next(1)
    preempted.preempt(2, D)
    preempted.cancel(2)
    assert text(journal)[-1] == (2, "navigation.ended", "CANCELED")
    assert preempted.accept_next(2) is None


def test_canceled_task_ends_as_canceled_after_an_earlier_failure():
    tour, journal = task(C, D, stop=False)
    tour.accept_next(1)
    tour.record_failed(2, ErrorCode.NO_VALID_PATH, "no way")
    tour.accept_next(3)
    tour.cancel(4)
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
    tour, journal = task(C, stop=stop, mode=mode)
    tour.accept_next(1)
    tour.record_failed(2, ErrorCode.NO_VALID_PATH, "no way")
    assert journal[-2].data["error_name"] == "NO_VALID_PATH"  # of the goal itself
    assert journal[-1].data == {"error_code": int(code), "error_name": code.name}


def test_a_goal_has_its_name_in_every_loop():
    assert [loop_goal_name("shelf", loop) for loop in (1, 2, 12)] == ["shelf", "shelf#2", "shelf#12"]
    assert matches_goal_name("shelf#2", "shelf")
    assert matches_goal_name("shelf#2", "shelf#2")
    assert matches_goal_name("shelf", None)
    assert not matches_goal_name("shelf", "shelf#2")
    assert not matches_goal_name("shelf#2", "shelf#3")
    assert not matches_goal_name("shelf#b", "shelf")
    assert not matches_goal_name("bookshelf#2", "shelf")


def test_error_codes_through_poses_have_the_names_of_those_to_one_pose():
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
    begun = Task(True)
    begun.start((Goal("a", Pose2(1, 0)),))
    assert [event.kind for event in begun.accept_next(0)] == ["goal.accepted"]
