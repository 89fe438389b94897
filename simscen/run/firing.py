"""When a trigger fires: edges, delays, repetitions and chance."""

import numpy as np

from simscen.core.stage import Situation
from simscen.triggers.trigger import Test, Trigger


class Firing:
    """Watches one trigger, beat by beat.

    A rising trigger whose condition holds from the start fires at once; a falling one needs to have seen it hold.
    """

    def __init__(self, trigger: Trigger, chance: np.random.Generator) -> None:
        self._trigger, self._chance = trigger, chance
        self._watch = Watch(trigger)
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
        before, self._held = self._held, self._watch.holds(now)
        return self._held != before and self._held == (self._trigger.edge == "rising")

    def _lucky(self) -> bool:
        return self._trigger.probability >= 1 or bool(self._chance.random() < self._trigger.probability)


class Watch:
    """Remembers since when a condition and each of its parts have been true, for their `for`; asked at every beat."""

    def __init__(self, test: Test) -> None:
        self._test = test
        lasting = any(part.for_ is not None for inner in test.inner for part in inner.parts())
        self._parts = [Watch(inner) for inner in test.inner] if lasting else []
        self._since: int | None = None

    def holds(self, now: Situation) -> bool:
        """Whether it is true, and has been for long enough."""
        if not self._is_true(now):
            self._since = None
            return False
        if self._since is None:
            self._since = now.tick
        return self._test.for_ is None or now.tick - self._since >= now.clock.ticks(self._test.for_)

    def _is_true(self, now: Situation) -> bool:
        """Whether it is true at this beat; each part is asked, as it has to see all of them."""
        if not self._parts:
            return self._test.holds(now)
        now = self._test.seen(now)
        answers = [part.holds(now) for part in self._parts]
        if self._test.not_ is not None:
            return not answers[0]
        return all(answers) if self._test.all is not None else any(answers)
