"""How much of the global costmap is forgotten when there is no way."""

INITIAL_WAIT_S = 10.0
"""Seconds until all may be forgotten once more; each time that comes to nothing doubles them."""
PROGRESS_M = 1.0
"""Metres by which a robot must have come nearer to its goal for what it forgot to have come to something."""


class ClearingBackoff:
    """Says whether a plan that failed clears all of the global costmap, or only what lies around the robot.

    What was seen elsewhere may have gone, so all of it is forgotten at first (Nav2's tree does so each time). But who
    forgets again what was just seen finds a way round the end of the wall that is out of sight, drives there until it
    sees it, and has forgotten the other end by then: to and fro, for ever.
    """

    def __init__(self, always: bool) -> None:
        """`always`: as Nav2's tree."""
        self._always = always
        self.reset()

    def reset(self) -> None:
        """A new goal."""
        self._wait, self._due, self._nearest = INITIAL_WAIT_S, 0.0, float("inf")

    def entirely(self, now: float, to_go: float) -> bool:
        """Whether to forget all of it `now`, in seconds, with the goal `to_go` metres away as the crow flies."""
        if to_go <= self._nearest - PROGRESS_M:
            self._wait, self._due = INITIAL_WAIT_S, now
        if now < self._due and not self._always:
            return False
        self._due, self._wait = now + self._wait, 2 * self._wait
        self._nearest = min(self._nearest, to_go)
        return True
