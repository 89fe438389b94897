"""Start the events and faults of a scenario when their triggers fire."""

from typing import cast

from simscen.core.random_streams import Streams
from simscen.core.records.events import Event, EventKind, Value
from simscen.core.stage import Situation
from simscen.model.disturbances import FaultEntry, Step
from simscen.run.faults.injector import FaultInjector
from simscen.run.live_world.random_streams import stream_names
from simscen.run.live_world.stage import LiveStage
from simscen.run.live_world.trigger_state import RelativeSituation, TriggerState
from simscen.triggers.time import Time
from simscen.triggers.trigger import Trigger

_AT_ONCE = Trigger(time=Time(0.0))


class Director:
    """Evaluates all triggers at each beat: first of events, then of faults, each in the order of the scenario."""

    def __init__(
        self, steps: list[Step], faults: list[FaultEntry], streams: Streams, stage: LiveStage, rig: FaultInjector
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

    def _perform(self, number: int, step: Step) -> None:
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
