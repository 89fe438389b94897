"""The task that packages import: each thing that becomes of a goal is in the list that the stack handed over."""

from simscen.core.geometry import Pose2
from simscen.core.navigation import ErrorCode
from simscen.core.time import Clock
from simscen.plugin import Event, EventKind, Goal, Task

A, B, C = (Goal(name, Pose2(x, 0)) for x, name in enumerate("abc"))
WAITS = Goal("waits", Pose2(3, 0), wait=0.5)


def begun(*goals: Goal, stop: bool = False) -> tuple[Task, list[Event]]:
    journal: list[Event] = []
    task = Task(stop, journal, Clock(100), "navigate_to_pose")
    task.start(goals)
    return task, journal


def kinds(journal: list[Event]) -> list[tuple[str, str]]:
    return [(event.kind, event.name) for event in journal]


def test_it_answers_with_the_goal_and_writes_down_what_became_of_it() -> None:
    task, journal = begun(A, B)
    assert (task.next(3), task.goal, task.since, task.following) == (A, A, 3, B)
    task.reached(5)
    assert task.goal is None
    assert task.next(6) is B
    task.failed(7, ErrorCode.NO_VALID_PATH, "walled in")
    assert task.next(8) is None
    assert kinds(journal) == [
        (EventKind.GOAL_ACCEPTED, "a"),
        (EventKind.GOAL_REACHED, "a"),
        (EventKind.GOAL_ACCEPTED, "b"),
        (EventKind.GOAL_FAILED, "b"),
        (EventKind.NAVIGATION_ENDED, "FAILED"),
    ]


def test_a_journal_that_was_emptied_is_written_on() -> None:
    task, journal = begun(A)
    task.next(0)
    journal[:] = []
    task.preempt(1, C)
    assert task.next(1) is C
    task.cancel(2)
    assert kinds(journal)[:3] == [
        (EventKind.GOAL_CANCELED, "a"),
        (EventKind.GOAL_ACCEPTED, "c"),
        (EventKind.GOAL_CANCELED, "c"),
    ]


def test_goals_to_pass_and_waits() -> None:
    through = Goal("through", Pose2(1, 0), via=True)
    task, journal = begun(through, WAITS)
    task.next(0)
    assert task.ahead == (WAITS,)
    task.passed(1)
    task.next(1)
    task.reached(10)
    assert task.next(11) is None
    assert task.rest(59)
    assert not task.rest(60)
    assert kinds(journal)[-1] == (EventKind.NAVIGATION_ENDED, "SUCCEEDED")


def test_without_a_clock_and_a_mode() -> None:
    journal: list[Event] = []
    task = Task(True, journal)
    task.start((A,))
    assert task.next(0) is A
    assert len(journal) == 1
