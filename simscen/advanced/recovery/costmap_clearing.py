"""Clearing of the global costmap with back-off, so that the robot does not forget both ends of a dead end in turn."""

INITIAL_WAIT_S = 10.0
"""Time until the entire costmap may be cleared again; it doubles each time."""
PROGRESS_M = 1.0
"""The robot must have come this much closer to its goal for the last clearing to count as successful."""


class ClearingBackoff:
    """Clear the entire global costmap at first and then ever more rarely, otherwise only the area around the robot.

    Obstacles that were seen earlier may have disappeared. But a robot that clears the costmap each time it finds no
    path plans around the end of a wall that is out of sight, drives there, sees it, and has forgotten the other end.
    """

    def __init__(self) -> None:
        """Start as for a new goal."""
        self.reset()

    def reset(self) -> None:
        """Prepare for a new goal."""
        self._wait, self._due, self._nearest = INITIAL_WAIT_S, 0.0, float("inf")

    def entirely(self, now: float, to_go: float) -> bool:
        """Return whether to clear all of it `now` (s), with the goal `to_go` m away in a straight line."""
        if to_go <= self._nearest - PROGRESS_M:
            self._wait, self._due = INITIAL_WAIT_S, now
        if now < self._due:
            return False
        self._due, self._wait = now + self._wait, 2 * self._wait
        self._nearest = min(self._nearest, to_go)
        return True
