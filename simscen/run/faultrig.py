"""The faults of a scenario, between the sensors and the stack, and between the stack and the wheels."""

import math
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, fields
from typing import NoReturn

import numpy as np

from simscen.core.chance import Streams
from simscen.core.errors import BROKEN, RunError
from simscen.core.events import Event, EventKind
from simscen.core.motion import Twist
from simscen.core.sensing import Reading, Readings
from simscen.faults.base import Disturbance, Wheels
from simscen.model.disturbance import FaultEntry
from simscen.run.streamnames import stream_names

ROUNDING = 1e-9
"""What a fault that changes nothing may still change in a number, by adding increments up."""


@dataclass
class _Active:
    """A fault at work; `touched` counts the messages and commands that it changed or kept back."""

    sensor: str
    disturbance: Disturbance
    touched: int = 0
    over: bool = False


class FaultRig:
    """Disturbs readings and commands with the faults that are under way, in the order of the scenario."""

    def __init__(
        self, faults: list[FaultEntry], streams: Streams, wheels: Wheels, note: Callable[[Event], None]
    ) -> None:
        """`note` takes a fault.took_effect when a fault changes its first message or command."""
        self._faults, self._streams, self._wheels, self._note = faults, streams, wheels, note
        self._names = stream_names(faults)
        self._begun: Counter[int] = Counter()
        # By number of the fault and count of its activations: what one activation leaves behind, the next builds on.
        self._active: dict[tuple[int, int], _Active] = {}

    def begin(self, index: int) -> None:
        """Start the scenario's fault number `index`; each time its chance is a stream of its own."""
        entry = self._faults[index]
        self._begun[index] += 1
        chance = self._streams.generator(f"fault{self._names[index]}#{self._begun[index]}")
        disturbance: object = entry.fault.begin(chance, self._wheels)
        if not isinstance(disturbance, Disturbance):
            self._broke(index, f"begins as {disturbance!r}, which is no Disturbance")
        self._active[index, self._begun[index]] = _Active(entry.sensor, disturbance)

    def end(self, index: int) -> int:
        """End it; what it leaves behind stays at work. Returns how many messages and commands it has touched."""
        key = index, self._begun[index]
        active = self._active.pop(key)
        if rest := active.disturbance.end():
            self._active[key] = _Active(active.sensor, rest, over=True)
        return active.touched

    def disturb(self, readings: Readings) -> Readings:
        """The readings as the stack gets them."""
        if not self._active or not readings:
            return readings
        disturbed = (self._reading(reading) for reading in readings)
        return tuple(reading for reading in disturbed if reading is not None)

    def command(self, command: Twist) -> Twist:
        """The command as the wheels get it."""
        for (index, _), active in self._at_work():
            disturbed = active.disturbance.command(command)
            if not isinstance(disturbed, Twist) or not all(map(math.isfinite, disturbed)):
                self._broke(index, f"makes {disturbed!r} of a command")
            if not np.allclose(disturbed, command, rtol=0.0, atol=ROUNDING):
                self._count(index, active)
            command = disturbed
        return command

    def _at_work(self) -> list[tuple[tuple[int, int], _Active]]:
        return sorted(self._active.items(), key=lambda item: item[0])

    def _reading(self, reading: Reading) -> Reading | None:
        current: Reading | None = reading
        for (index, _), active in self._at_work():
            if current is not None and active.sensor == reading.sensor:
                disturbed = active.disturbance.reading(_kept(current))
                if disturbed is not None and _signed(disturbed) != _signed(current):
                    self._broke(index, f"makes {type(disturbed).__name__} of the {type(current).__name__} of a sensor")
                if disturbed is None or not _equal(disturbed, current):
                    self._count(index, active)
                current = disturbed
        return current

    def _broke(self, index: int, what: str) -> NoReturn:
        entry = self._faults[index]
        raise RunError(BROKEN, f"fault `{entry.label}` {what}{entry.added_by}")

    def _count(self, index: int, active: _Active) -> None:
        if active.over:
            return
        if not active.touched:
            self._note(Event(0, EventKind.FAULT_TOOK_EFFECT, self._faults[index].label, {"entry": index}))
        active.touched += 1


def _kept(reading: Reading) -> Reading:
    """The reading, its arrays kept from being written to: what a fault changes in place would not count as changed."""
    for array in (getattr(reading, field.name) for field in fields(reading)):
        if isinstance(array, np.ndarray):
            array.flags.writeable = False
    return reading


def _signed(reading: object) -> tuple[type, object]:
    return type(reading), getattr(reading, "sensor", None)


def _equal(one: Reading, other: Reading) -> bool:
    """Whether two readings of one sensor say the same but for rounding; beams without an answer (nan) do."""
    if one is other:
        return True
    said = [(getattr(one, field.name), getattr(other, field.name)) for field in fields(one) if field.name != "sensor"]
    return all(np.allclose(a, b, rtol=0.0, atol=ROUNDING, equal_nan=True) for a, b in said)
