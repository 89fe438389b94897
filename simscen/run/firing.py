"""When a trigger fires: edges, delays, repetitions and chance."""

import numpy as np

from simscen.core.stage import Situation
from simscen.triggers.trigger import Trigger


class Firing:
    """Watches one trigger, beat by beat.

    A rising trigger whose condition holds from the start fires at once; a falling one needs to have seen it hold.
    """

    def __init__(self, trigger: Trigger, chance: np.random.Generator) -> None:
        self._trigger, self._chance = trigger, chance
        self._held = False
        self._left = trigger.times
        self._due: list[int] = []

    def fires(self, now: Situation) -> int:
        """How often it fires at this beat."""
        if self._left and self._edge(now) and self._lucky():
            self._left -= 1
            self._due.append(now.tick + now.clock.ticks(self._trigger.delay))
        ripe = sum(due <= now.tick for due in self._due)
        self._due = self._due[ripe:]
        return ripe

    @property
    def spent(self) -> bool:
        """Whether it can never fire again."""
        return not self._left and not self._due

    def _edge(self, now: Situation) -> bool:
        before, self._held = self._held, self._trigger.holds(now)
        return self._held != before and self._held == (self._trigger.edge == "rising")

    def _lucky(self) -> bool:
        return self._trigger.probability >= 1 or bool(self._chance.random() < self._trigger.probability)
