"""The recovery branch of Nav2's default tree: a round robin of behaviors, a limited number of times."""

import math
from collections.abc import Sequence
from typing import get_args

from simscen.model.recovery import PlannerCode, Recovery
from simscen.stack.protocols import Behavior, NavigationFailure

PLANNER_CODES = frozenset(get_args(PlannerCode))


PROGRESS_M = 1.0
"""Meters by which a robot must have come nearer to its goal than at any recovery before, for that to be progress."""


class RoundRobin:
    """Hands out behaviors in turn until the retries have been used; a new goal gets a full number again."""

    def __init__(self, behaviors: Sequence[Behavior], spec: Recovery) -> None:
        self._behaviors, self._retries = tuple(behaviors), spec.number_of_retries
        self._incurable = PLANNER_CODES.difference(spec.planner_codes)
        self._anew = spec.retries_since_progress
        self._next, self._used, self._nearest = 0, 0, math.inf

    def helps(self, failure: NavigationFailure) -> bool:
        """Whether clearing and behaviors may help after such a failure."""
        return getattr(failure.code, "name", "") not in self._incurable

    def reset(self) -> None:
        """A new goal; the turn goes on where it was, as in Nav2."""
        self._used, self._nearest = 0, math.inf

    def next(self, to_go: float) -> Behavior | None:
        """The next behavior, with the goal `to_go` meters away; None when the retries are used up."""
        if self._anew and to_go <= self._nearest - PROGRESS_M and self._used:
            self._used = self._next = 0
        self._nearest = min(self._nearest, to_go)
        if not self._behaviors or self._used >= self._retries:
            return None
        behavior = self._behaviors[self._next % len(self._behaviors)]
        self._next += 1
        self._used += 1
        return behavior
