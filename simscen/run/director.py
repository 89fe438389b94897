"""The director watches the triggers of a scenario and lets its events and faults happen."""

from simscen.core.chance import Streams
from simscen.core.events import Event, EventKind, Value
from simscen.model.disturbance import EventEntry, FaultEntry
from simscen.run.faultrig import FaultRig
from simscen.run.firing import Firing
from simscen.run.live import LiveStage
from simscen.run.streamnames import stream_names
from simscen.triggers.time import Time
from simscen.triggers.trigger import Trigger

_AT_THE_START = Trigger(time=Time(0.0))


class Director:
    """Directs one run: first events, then faults, each in the order of the scenario."""

    def __init__(
        self, events: list[EventEntry], faults: list[FaultEntry], streams: Streams, stage: LiveStage, rig: FaultRig
    ) -> None:
        self._stage, self._rig, self._faults = stage, rig, faults
        self._events = [
            (entry.name or f"event-{number}", entry, Firing(entry.when, streams.generator(f"event{stream}")))
            for number, (entry, stream) in enumerate(zip(events, stream_names(events), strict=True), start=1)
        ]
        self._starts = [
            Firing(entry.when or _AT_THE_START, streams.generator(f"fault-start{stream}"))
            for entry, stream in zip(faults, stream_names(faults), strict=True)
        ]
        self._ends: dict[int, int | None] = {}

    def direct(self) -> None:
        """Let happen what is due at this beat; the stage keeps the record."""
        for number, (name, entry, firing) in enumerate(self._events):
            for _ in range(0 if firing.spent else firing.fires(self._stage)):
                self._perform(number, name, entry)
        self._end_faults()
        for index, firing in enumerate(self._starts):
            if not firing.spent and firing.fires(self._stage) and index not in self._ends:
                self._begin_fault(index)

    def _perform(self, number: int, name: str, entry: EventEntry) -> None:
        kinds: list[Value] = [action.kind for action in entry.actions]
        self._stage.note(Event(0, EventKind.EVENT_STARTED, name, {"entry": number, "actions": kinds}))
        effects = [action.perform(self._stage) for action in entry.actions]
        told: list[Value] = [{"happened": effect.happened, "what": effect.what} for effect in effects]
        self._stage.note(Event(0, EventKind.EVENT_ENDED, name, {"entry": number, "effects": told}))

    def _begin_fault(self, index: int) -> None:
        entry = self._faults[index]
        self._rig.begin(index)
        lasts = None if entry.for_ is None else self._stage.clock.ticks(entry.for_)
        self._ends[index] = None if lasts is None else self._stage.tick + lasts
        about: dict[str, Value] = {"entry": index, "sensor": entry.sensor, "fault": entry.kind}
        self._stage.note(Event(0, EventKind.FAULT_STARTED, entry.label, about))

    def _end_faults(self) -> None:
        for index, end in sorted(self._ends.items()):
            if end is not None and self._stage.tick >= end:
                del self._ends[index]
                touched = self._rig.end(index)
                about: dict[str, Value] = {"entry": index, "touched": touched}
                self._stage.note(Event(0, EventKind.FAULT_ENDED, self._faults[index].label, about))
