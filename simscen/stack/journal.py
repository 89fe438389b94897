"""The list of goals as an author's stack keeps it: what becomes of them is written into a list of the stack's own."""

from simscen.core.events import Event
from simscen.core.goalnames import Mode
from simscen.core.navigation import ErrorCode, Goal
from simscen.core.time import Clock
from simscen.stack import tasks


class Task:
    """Goals in order, and the events that a client of the action would see.

    Goals that are passed (`via`) and the one after them are one action: they fail, are canceled and preempted together.
    """

    def __init__(
        self, stop_on_failure: bool, journal: list[Event], clock: Clock | None = None, mode: Mode = "navigate_to_pose"
    ) -> None:
        """`clock` says how many ticks the goals' `wait` takes; default: as many as the default clock's."""
        self._task, self._journal = tasks.Task(stop_on_failure, clock, mode), journal

    @property
    def goal(self) -> Goal | None:
        """What is being driven to; None, too, while the robot waits where it is."""
        return self._task.goal

    @property
    def since(self) -> int:
        """The tick at which the goal was accepted."""
        return self._task.since

    @property
    def ahead(self) -> tuple[Goal, ...]:
        """What follows the current goal in the same drive."""
        return self._task.ahead

    @property
    def following(self) -> Goal | None:
        """The goal that is next."""
        return self._task.following

    def start(self, goals: tuple[Goal, ...]) -> None:
        """A new task."""
        self._task.start(goals)

    def next(self, tick: int) -> Goal | None:
        """Accept the next goal if none is being driven to; end the task when there is none left.

        None, too, while the robot waits where it is.
        """
        self._journal += self._task.next(tick)
        return self._task.goal

    def rest(self, tick: int) -> bool:
        """Whether the robot is to stay where it is at this tick; the task ends with its last wait."""
        self._journal += self._task.rest(tick)
        return self._task.stays

    def reached(self, tick: int) -> None:
        """The goal is reached."""
        self._journal += self._task.reached(tick)

    def passed(self, tick: int) -> None:
        """The goal, which is one to pass, is behind the robot."""
        self._journal += self._task.passed(tick)

    def failed(self, tick: int, code: ErrorCode | int, message: str) -> None:
        """The goal has failed; so has the task when it stops on failures. A number is a code that has no name here."""
        self._journal += self._task.failed(tick, code, message)

    def cancel(self, tick: int) -> None:
        """Drop this goal and all after it."""
        self._journal += self._task.cancel(tick)

    def preempt(self, tick: int, goal: Goal) -> None:
        """Drop this goal for another one; those after it follow. It ends a wait, too."""
        self._journal += self._task.preempt(tick, goal)
