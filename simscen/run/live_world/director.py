"""Start the events and faults of a scenario when their triggers fire, and end the faults when their time is over."""

from collections.abc import Sequence
from typing import Any, cast

import numpy as np

from simscen.core.random_streams import Streams
from simscen.core.records.events import Event, EventKind, Value
from simscen.core.stage import Situation
from simscen.model.disturbances import FaultEntry, SequenceStep
from simscen.run.faults.injector import FaultInjector
from simscen.run.live_world.stage import LiveStage
from simscen.run.stream_names import stream_names
from simscen.triggers.base import AnyCondition, Trigger
from simscen.triggers.timing import Time

_IMMEDIATE_TRIGGER = Trigger(time=Time(0.0))
"""Trigger of events and faults without `when`."""


class Director:
    """Evaluates all triggers at each beat, starts events and faults, and ends faults."""

    def __init__(
        self,
        steps: list[SequenceStep],
        faults: list[FaultEntry],
        streams: Streams,
        stage: LiveStage,
        injector: FaultInjector,
    ) -> None:
        """Prepare the events (`steps`) and the `faults`. Triggers observe the world through `stage`; actions change it.

        `injector` starts and ends the faults. `streams` gives random numbers for triggers with a probability.
        """
        self._stage, self._injector, self._faults = stage, injector, faults
        self._steps = [
            (step, TriggerState(step.when or _IMMEDIATE_TRIGGER, streams.generator(f"event{stream}")))
            for step, stream in zip(steps, stream_names([step.entry for step in steps]), strict=True)
        ]
        self._situations: dict[int, Situation] = {k: stage for k, step in enumerate(steps) if step.after is None}
        """Situation that the trigger of a step observes, by step index; missing until the previous step happened."""
        self._starts = [
            TriggerState(entry.when or _IMMEDIATE_TRIGGER, streams.generator(f"fault-start{stream}"))
            for entry, stream in zip(faults, stream_names(faults), strict=True)
        ]
        self._ends: dict[int, int | None] = {}
        """Tick at which each active fault ends, by index of the fault; None for the end of the run."""

    @property
    def has_disturbances(self) -> bool:
        """Whether there is any event or fault."""
        return bool(self._steps or self._starts)

    def process_beat(self) -> None:
        """Perform the events that are due, and end and start faults that are due. Call it once at each beat."""
        for index, (step, trigger) in enumerate(self._steps):
            situation = self._situations.get(index)
            for _ in range(0 if situation is None or trigger.is_exhausted else trigger.count_firings(situation)):
                self._perform_step(index, step)
        if self._ends:
            self._end_due_faults()
        for index, trigger in enumerate(self._starts):
            if not trigger.is_exhausted and trigger.count_firings(self._stage) and index not in self._ends:
                self._begin_fault(index)

    def _perform_step(self, index: int, step: SequenceStep) -> None:
        kinds: list[Value] = [action.kind for action in step.actions]
        self._stage.record_world_event(Event(0, EventKind.EVENT_STARTED, step.name, {"entry": index, "actions": kinds}))
        effects = [action.choice.perform(self._stage) for action in step.actions]
        effect_data: list[Value] = [{"happened": effect.happened, "what": effect.what} for effect in effects]
        self._stage.record_world_event(
            Event(0, EventKind.EVENT_ENDED, step.name, {"entry": index, "effects": effect_data})
        )
        # From now on, evaluate the trigger of the next step of the same sequence.
        if index + 1 < len(self._steps) and self._steps[index + 1][0].after == index:
            self._situations[index + 1] = cast(Situation, RelativeSituation(self._stage))

    def _begin_fault(self, index: int) -> None:
        entry = self._faults[index]
        kind = self._injector.begin(index)
        duration = None if entry.for_ is None else self._stage.clock.ticks(entry.for_)
        self._ends[index] = None if duration is None else self._stage.tick + duration
        data: dict[str, Value] = {"entry": index, "sensor": entry.sensor, "fault": entry.kind, "affects": kind}
        self._stage.record_event(Event(0, EventKind.FAULT_STARTED, entry.label, data))

    def _end_due_faults(self) -> None:
        for index, end in sorted(self._ends.items()):
            if end is not None and self._stage.tick >= end:
                del self._ends[index]
                changed_count = self._injector.end(index)
                data: dict[str, Value] = {"entry": index, "touched": changed_count}
                self._stage.record_event(Event(0, EventKind.FAULT_ENDED, self._faults[index].label, data))


class TriggerState:
    """Evaluates one trigger at each beat.

    A rising trigger fires when its condition becomes true, a falling trigger when its condition becomes false.
    """

    def __init__(self, trigger: Trigger, rng: np.random.Generator) -> None:
        self._trigger, self._rng = trigger, rng
        self._condition = ConditionState(trigger)
        self._was_true = False
        self._remaining = trigger.times
        self._scheduled: list[int] = []

    def count_firings(self, situation: Situation) -> int:
        """Evaluate the trigger in `situation`, and return how often it fires. Call it once at each beat."""
        trigger = self._trigger
        if (
            self._remaining
            and self._has_edge(situation)
            and (trigger.probability >= 1 or self._rng.random() < trigger.probability)
        ):
            self._remaining -= 1
            self._scheduled.append(situation.tick + situation.clock.ticks(trigger.delay))
        due = sum(scheduled <= situation.tick for scheduled in self._scheduled)
        self._scheduled = self._scheduled[due:]
        return due

    @property
    def is_exhausted(self) -> bool:
        """Whether the trigger can never fire again."""
        return not self._remaining and not self._scheduled

    def _has_edge(self, situation: Situation) -> bool:
        """Return whether the condition has changed in the direction that fires the trigger."""
        before, self._was_true = self._was_true, self._condition.holds(situation)
        return self._was_true != before and self._was_true == (self._trigger.edge == "rising")


class ConditionState:
    """Tracks how long a condition and its operands have been true, for the key `for`. Call `holds` at each beat."""

    def __init__(self, condition: AnyCondition) -> None:
        self._condition = condition
        has_durations = any(part.for_ is not None for operand in condition.operands for part in operand.walk())
        self._operands = [ConditionState(operand) for operand in condition.operands] if has_durations else []
        self._since: int | None = None

    def holds(self, situation: Situation) -> bool:
        """Return whether the condition has been true for the required duration, up to `situation`."""
        if not self._is_true(situation):
            self._since = None
            return False
        if self._since is None:
            self._since = situation.tick
        duration = self._condition.for_
        return duration is None or situation.tick - self._since >= situation.clock.ticks(duration)

    def _is_true(self, situation: Situation) -> bool:
        """Return whether the condition is true at this beat. Evaluates all operands, because each tracks a duration."""
        if not self._operands:
            return self._condition.holds(situation)
        situation = self._condition.situation_of_robot(situation)
        are_true = [operand.holds(situation) for operand in self._operands]
        if self._condition.not_ is not None:
            return not are_true[0]
        return all(are_true) if self._condition.all is not None else any(are_true)


class RelativeSituation:
    """Situation as seen by a step of a sequence: time, distance, and events count from the previous step."""

    def __init__(self, situation: Situation, others: "dict[str, RelativeSituation] | None" = None) -> None:
        """Start counting at `situation`. `others` are the views of all robots by name (None: create them)."""
        self._situation, self._others = situation, {} if others is None else others
        if others is None:
            self._others |= {name: RelativeSituation(situation.of(name), self._others) for name in situation.robots}
        self._start_tick, self._initial_distance = situation.tick, situation.travelled
        self._initial_event_count = len(situation.events)

    def of(self, robot: str) -> "RelativeSituation":
        """Return the situation of another robot, relative to the same step."""
        return self._others[robot]

    @property
    def tick(self) -> int:
        """Ticks since the previous step."""
        return self._situation.tick - self._start_tick

    @property
    def travelled(self) -> float:
        """Distance driven in m since the previous step."""
        return self._situation.travelled - self._initial_distance

    @property
    def events(self) -> Sequence[Event]:
        """Events since the previous step."""
        return self._situation.events[self._initial_event_count :]

    def last_scan_tick(self, sensor: str | None) -> int | None:
        """Return the tick at which the stack last received a scan, relative to the previous step.

        If there was no scan, the start of the run counts as a scan.
        """
        last = self._situation.last_scan_tick(sensor)
        return (0 if last is None else last) - self._start_tick

    def __getattr__(self, name: str) -> Any:
        """Return any other attribute of the situation, such as the robot's pose."""
        return getattr(self._situation, name)
