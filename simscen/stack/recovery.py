"""Recovery branch of Nav2's default behavior tree: a round robin of behaviors with a limited number of retries."""

import math
from collections.abc import Sequence
from typing import get_args

from simscen.model.recovery import PlannerCode, Recovery
from simscen.stack.protocols import Behavior, NavigationFailure

PLANNER_CODES = frozenset(get_args(PlannerCode))


PROGRESS_M = 1.0
"""Progress is a decrease of the distance to the goal by this much since the closest recovery so far."""


class RoundRobin:
    """Behaviors in turn, until the retries for a goal are used up."""

    def __init__(self, behaviors: Sequence[Behavior], spec: Recovery) -> None:
        """Take the behaviors and the parameters of the recovery."""
        self._behaviors, self._max_retries = tuple(behaviors), spec.number_of_retries
        self._final_codes = PLANNER_CODES.difference(spec.planner_codes)
        self._resets_on_progress = spec.retries_since_progress
        self._next, self._used, self._nearest = 0, 0, math.inf

    def helps(self, failure: NavigationFailure) -> bool:
        """Return whether to try a recovery after a failure with this code."""
        return getattr(failure.code, "name", "") not in self._final_codes

    def reset(self) -> None:
        """Restore all retries for a new goal. The next behavior stays the same, as in Nav2."""
        self._used, self._nearest = 0, math.inf

    def next(self, to_go: float) -> Behavior | None:
        """Return the next behavior, with the goal `to_go` meters away, or None if the retries are used up."""
        if self._resets_on_progress and to_go <= self._nearest - PROGRESS_M and self._used:
            self._used = self._next = 0
        self._nearest = min(self._nearest, to_go)
        if not self._behaviors or self._used >= self._max_retries:
            return None
        behavior = self._behaviors[self._next % len(self._behaviors)]
        self._next += 1
        self._used += 1
        return behavior
