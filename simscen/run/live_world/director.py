"""Start the events and faults of a scenario when their triggers fire."""

from typing import Any, cast

import numpy as np

from simscen.core.random_streams import Streams
from simscen.core.records.events import Event, EventKind, Value
from simscen.core.stage import Situation
from simscen.model.disturbances import FaultEntry, SequenceStep
from simscen.run.faults.injector import FaultInjector
from simscen.run.live_world.stage import LiveStage
from simscen.run.random_streams import stream_names
from simscen.triggers.base import AnyCondition, Trigger
from simscen.triggers.timing import Time

_AT_ONCE = Trigger(time=Time(0.0))


class Director:
    """Evaluates all triggers at each beat: first of events, then of faults, each in the order of the scenario."""

    def __init__(
        self,
        steps: list[SequenceStep],
        faults: list[FaultEntry],
        streams: Streams,
        stage: LiveStage,
        rig: FaultInjector,
    ) -> None:
        self._stage, self._rig, self._faults = stage, rig, faults
        self._steps = [
            (step, TriggerState(step.when or _AT_ONCE, streams.generator(f"event{stream}")))
            for step, stream in zip(steps, stream_names([step.entry for step in steps]), strict=True)
        ]
        self._views: dict[int, Situation] = {k: stage for k, step in enumerate(steps) if step.after is None}
        self._starts = [
            TriggerState(entry.when or _AT_ONCE, streams.generator(f"fault-start{stream}"))
            for entry, stream in zip(faults, stream_names(faults), strict=True)
        ]
        self._ends: dict[int, int | None] = {}

    @property
    def needed(self) -> bool:
        """Whether there is any event or fault."""
        return bool(self._steps or self._starts)

    def direct(self) -> None:
        """Perform the events and start and end the faults that are due at this beat."""
        for number, (step, firing) in enumerate(self._steps):
            view = self._views.get(number)
            for _ in range(0 if view is None or firing.spent else firing.fires(view)):
                self._perform(number, step)
                self._go_on(number)
        if self._ends:
            self._end_faults()
        for index, firing in enumerate(self._starts):
            if not firing.spent and firing.fires(self._stage) and index not in self._ends:
                self._begin_fault(index)

    def _perform(self, number: int, step: SequenceStep) -> None:
        kinds: list[Value] = [action.kind for action in step.actions]
        self._stage.tell(Event(0, EventKind.EVENT_STARTED, step.name, {"entry": number, "actions": kinds}))
        effects = [action.perform(self._stage) for action in step.actions]
        told: list[Value] = [{"happened": effect.happened, "what": effect.what} for effect in effects]
        self._stage.tell(Event(0, EventKind.EVENT_ENDED, step.name, {"entry": number, "effects": told}))

    def _go_on(self, number: int) -> None:
        """Start to evaluate the trigger of the step that follows this one."""
        if number + 1 < len(self._steps) and self._steps[number + 1][0].after == number:
            self._views[number + 1] = cast(Situation, RelativeSituation(self._stage))

    def _begin_fault(self, index: int) -> None:
        entry = self._faults[index]
        kind = self._rig.begin(index)
        lasts = None if entry.for_ is None else self._stage.clock.ticks(entry.for_)
        self._ends[index] = None if lasts is None else self._stage.tick + lasts
        about: dict[str, Value] = {"entry": index, "sensor": entry.sensor, "fault": entry.kind, "affects": kind}
        self._stage.note(Event(0, EventKind.FAULT_STARTED, entry.label, about))

    def _end_faults(self) -> None:
        for index, end in sorted(self._ends.items()):
            if end is not None and self._stage.tick >= end:
                del self._ends[index]
                touched = self._rig.end(index)
                about: dict[str, Value] = {"entry": index, "touched": touched}
                self._stage.note(Event(0, EventKind.FAULT_ENDED, self._faults[index].label, about))


class TriggerState:
    """Evaluates one trigger at each beat.

    A rising trigger fires at the first beat if its condition holds. A falling trigger fires only after its condition
    has held.
    """

    def __init__(self, trigger: Trigger, rng: np.random.Generator) -> None:
        self._trigger, self._rng = trigger, rng
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
        return self._trigger.probability >= 1 or bool(self._rng.random() < self._trigger.probability)


class ConditionState:
    """Tracks how long a condition and each of its parts have held, for `for`. Must be evaluated at every beat."""

    def __init__(self, test: AnyCondition) -> None:
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
