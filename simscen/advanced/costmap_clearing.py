"""Policy of the advanced stack for clearing the global costmap after planner errors."""

from simscen.stack.navigator import ClearingPolicy

INITIAL_WAIT_S = 10.0
"""Time after clearing the entire costmap until this may happen again; doubled each time."""
PROGRESS_M = 1.0
"""Decrease of the distance to the goal that resets the time between two clearings to INITIAL_WAIT_S."""


class ClearingBackoff(ClearingPolicy):
    """Policy that clears the entire global costmap at increasing intervals, and otherwise only around the robot."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Prepare for a new goal."""
        self._wait, self._due, self._nearest = INITIAL_WAIT_S, 0.0, float("inf")

    def clears_entirely(self, now: float, goal_distance: float) -> bool:
        """Return whether to clear the entire costmap (see ClearingPolicy). Call it once per clearing."""
        if goal_distance <= self._nearest - PROGRESS_M:
            self._wait, self._due = INITIAL_WAIT_S, now
        if now < self._due:
            return False
        self._due, self._wait = now + self._wait, 2 * self._wait
        self._nearest = min(self._nearest, goal_distance)
        return True
