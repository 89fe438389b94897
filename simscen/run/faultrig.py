"""The faults of a scenario, between the sensors and the stack, and between the stack and the wheels."""

from dataclasses import dataclass

from simscen.core.chance import Streams
from simscen.core.motion import Twist
from simscen.core.sensing import Reading, Readings
from simscen.faults.base import Disturbance, Wheels
from simscen.model.disturbance import FaultEntry


@dataclass
class _Active:
    sensor: str
    disturbance: Disturbance


class FaultRig:
    """Disturbs readings and commands with the faults that are under way, in the order of the scenario."""

    def __init__(self, faults: list[FaultEntry], streams: Streams, wheels: Wheels) -> None:
        self._faults, self._streams, self._wheels = faults, streams, wheels
        self._active: dict[int, _Active] = {}

    def begin(self, index: int) -> None:
        """Start the scenario's fault number `index`; its chance is a stream of its own."""
        entry = self._faults[index]
        chance = self._streams.generator(f"fault.{entry.label}#{index}")
        self._active[index] = _Active(entry.sensor, entry.fault.begin(chance, self._wheels))

    def end(self, index: int) -> None:
        """End it; what it leaves behind stays at work."""
        active = self._active.pop(index)
        if rest := active.disturbance.end():
            self._active[index] = _Active(active.sensor, rest)

    def disturb(self, readings: Readings) -> Readings:
        """The readings as the stack gets them."""
        if not self._active or not readings:
            return readings
        disturbed = (self._reading(reading) for reading in readings)
        return tuple(reading for reading in disturbed if reading is not None)

    def command(self, command: Twist) -> Twist:
        """The command as the wheels get it."""
        for _, active in sorted(self._active.items()):
            command = active.disturbance.command(command)
        return command

    def _reading(self, reading: Reading) -> Reading | None:
        current: Reading | None = reading
        for _, active in sorted(self._active.items()):
            if current is not None and active.sensor == reading.sensor:
                current = active.disturbance.reading(current)
        return current
