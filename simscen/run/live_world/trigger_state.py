"""State of triggers during a run: edges, delays, repetitions, and probability."""

from typing import Any

import numpy as np

from simscen.core.records.events import Event
from simscen.core.stage import Situation
from simscen.triggers.trigger import Test, Trigger


class TriggerState:
    """Evaluates one trigger at each beat.

    A rising trigger fires at the first beat if its condition holds. A falling trigger fires only after its condition
    has held.
    """

    def __init__(self, trigger: Trigger, chance: np.random.Generator) -> None:
        self._trigger, self._chance = trigger, chance
        self._watch = ConditionState(trigger)
        self._held = False
        self._left = trigger.times
        self._due: list[int] = []

    def fires(self, now: Situation) -> int:
        """Return how often the trigger fires at this beat."""
        if self._left and self._edge(now) and self._lucky():
            self._left -= 1
            self._due.append(now.tick + now.clock.ticks(self._trigger.delay))
        ripe = sum(due <= now.tick for due in self._due)
        self._due = self._due[ripe:]
        return ripe

    @property
    def spent(self) -> bool:
        """Whether the trigger can never fire again."""
        return not self._left and not self._due

    def _edge(self, now: Situation) -> bool:
        before, self._held = self._held, self._watch.holds(now)
        return self._held != before and self._held == (self._trigger.edge == "rising")

    def _lucky(self) -> bool:
        return self._trigger.probability >= 1 or bool(self._chance.random() < self._trigger.probability)


class ConditionState:
    """Tracks how long a condition and each of its parts have held, for `for`. Must be evaluated at every beat."""

    def __init__(self, test: Test) -> None:
        self._test = test
        lasting = any(part.for_ is not None for inner in test.inner for part in inner.parts())
        self._parts = [ConditionState(inner) for inner in test.inner] if lasting else []
        self._since: int | None = None

    def holds(self, now: Situation) -> bool:
        """Return whether the condition has held for long enough."""
        if not self._is_true(now):
            self._since = None
            return False
        if self._since is None:
            self._since = now.tick
        return self._test.for_ is None or now.tick - self._since >= now.clock.ticks(self._test.for_)

    def _is_true(self, now: Situation) -> bool:
        """Return whether the condition holds at this beat. Evaluates all parts, since each tracks its own duration."""
        if not self._parts:
            return self._test.holds(now)
        now = self._test.seen(now)
        answers = [part.holds(now) for part in self._parts]
        if self._test.not_ is not None:
            return not answers[0]
        return all(answers) if self._test.all is not None else any(answers)


class RelativeSituation:
    """View of the run for a step of a sequence: time, distance, and events count from the end of the previous step."""

    def __init__(self, now: Situation, others: "dict[str, RelativeSituation] | None" = None) -> None:
        self._now, self._others = now, {} if others is None else others
        if others is None:
            self._others |= {name: RelativeSituation(now.of(name), self._others) for name in now.robots}
        self._start, self._way, self._past = now.tick, now.travelled, len(now.events)

    def of(self, robot: str) -> "RelativeSituation":
        """Return the view for another robot."""
        return self._others[robot]

    @property
    def tick(self) -> int:
        """Ticks since the start of the view."""
        return self._now.tick - self._start

    @property
    def travelled(self) -> float:
        """Distance driven in m since the start of the view."""
        return self._now.travelled - self._way

    @property
    def events(self) -> tuple[Event, ...]:
        """Events since the start of the view."""
        return self._now.events[self._past :]

    def scanned(self, sensor: str | None) -> int | None:
        """Return the tick of the last scan that the stack received; the start of the run if there was none."""
        last = self._now.scanned(sensor)
        return (0 if last is None else last) - self._start

    def __getattr__(self, name: str) -> Any:
        return getattr(self._now, name)
