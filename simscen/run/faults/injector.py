"""Inject the faults of a robot into its readings, its localizer, and its commands.

Several faults of one instance form a chain in the order of the scenario: each receives the output of the one before. A
reading that a fault delays continues along the rest of the chain when it arrives.
"""

import math
from collections import Counter
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, fields
from typing import NoReturn

import numpy as np
import numpy.typing as npt

from simscen.core.errors import BROKEN_COMPONENT, RunError
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.navigation import Belief
from simscen.core.messages.sensor_data import Odometry, Reading, Readings
from simscen.core.random_streams import Streams
from simscen.core.records.events import BELIEF, COMMAND, WHEELS, Event, EventKind
from simscen.faults.base import Disturbance, FaultSetting
from simscen.model.disturbances import FaultEntry
from simscen.run.faults.interfaces import CommandLink
from simscen.run.random_streams import stream_names
from simscen.stack.localizers.ground_truth import TRUTH

ROUNDING = 1e-9
"""Largest difference of a number that is attributed to rounding and not to the fault."""


@dataclass
class _Active:
    """An active fault; `touched` counts the messages and commands that it changed or withheld."""

    index: int
    sensor: str
    kind: str
    disturbance: Disturbance
    touched: int = 0
    over: bool = False

    def hears(self, reading: Reading) -> bool:
        """Return whether the fault affects this reading. A fault of the wheels affects all wheel odometry."""
        if self.kind == WHEELS:
            return isinstance(reading, Odometry) and reading.sensor != TRUTH
        return reading.sensor == self.sensor


class FaultInjector:
    """Applies the active faults to readings, commands, and beliefs, in the order of the scenario."""

    def __init__(
        self,
        faults: list[FaultEntry],
        streams: Streams,
        setting: Callable[[FaultEntry], FaultSetting],
        link: CommandLink,
        note: Callable[[Event], None],
        mapped: Collection[int] = (),
    ) -> None:
        """`note` receives a `fault.took_effect` event when a fault changes its first message or command.

        `mapped` are the indices of the faults that changed the map before the run.
        """
        self._mapped = set(mapped)
        self._faults, self._streams, self._setting, self._link, self._note = faults, streams, setting, link, note
        self._names = stream_names(faults)
        self.possible = bool(faults)
        """Whether the robot has any fault."""
        self._begun: Counter[int] = Counter()
        # By number of the fault and count of its activations: what one activation leaves behind, the next builds on.
        self.active: dict[tuple[int, int], _Active] = {}
        self._linked = False
        self._believed: tuple[int, Belief, Belief] | None = None

    def begin(self, index: int) -> str:
        """Start the fault with this index. Each activation draws from a random stream of its own.

        Returns the kind of the affected sensor or actuator.
        """
        entry = self._faults[index]
        self._begun[index] += 1
        rng = self._streams.generator(f"fault{self._names[index]}#{self._begun[index]}")
        setting = self._setting(entry)
        disturbance: object = entry.fault.begin(rng, setting)
        if not isinstance(disturbance, Disturbance):
            self._broke(index, f"begins as {disturbance!r}, which is no Disturbance")
        self.active[index, self._begun[index]] = _Active(index, entry.sensor, setting.kind, disturbance)
        self._linked = self._linked or setting.kind == COMMAND
        return setting.kind

    def end(self, index: int) -> int:
        """End a fault and return how many messages and commands it changed. Delayed messages still arrive later."""
        key = index, self._begun[index]
        active = self.active.pop(key)
        if rest := active.disturbance.end():
            self.active[key] = _Active(index, active.sensor, active.kind, rest, over=True)
        return active.touched

    def disturb(self, readings: Readings) -> Readings:
        """Return the readings as the stack receives them."""
        if not self.active:
            return readings
        for active in self._at_work():
            if active.index in self._mapped:
                self._mapped.remove(active.index)
                self._count(active)
            late = self._late(active)
            heard = (self._reading(active, one) if active.hears(one) else one for one in readings)
            readings = (*late, *(one for one in heard if one is not None))
        return readings

    def command(self, tick: int, command: Twist) -> Twist:
        """Return the command as the wheels receive it: after faults of cmd_vel, then faults of the wheels."""
        sends = self._link.sends(tick, command)
        if not self._linked and not self.active:
            if sends:
                self._link.hear(tick, command)
            return command
        if self._linked:
            self._transmit(tick, command if sends else None)
            command = self._link.driven(tick)
        elif sends:
            self._link.hear(tick, command)
        for active in self._at_work():
            if active.kind == WHEELS or active.disturbance.drives:
                command = self._commanded(active, command) or command
        return command

    def belief(self, tick: int, belief: Belief) -> Belief:
        """Return the belief that the navigator receives."""
        if not self.active or not any(active.kind == BELIEF for active in self.active.values()):
            return belief
        if self._believed is None or self._believed[:2] != (tick, belief):
            told = belief
            for active in self._at_work():
                if active.kind == BELIEF:
                    told = self._told(active, told)
            self._believed = tick, belief, told
        return self._believed[2]

    def _at_work(self) -> list[_Active]:
        if not self.active:
            return []
        return [active for _, active in sorted(self.active.items(), key=lambda item: item[0])]

    def _late(self, active: _Active) -> Sequence[Reading]:
        late: object = active.disturbance.arriving()
        if not isinstance(late, list | tuple):
            self._broke(active.index, f"lets {late!r} arrive")
        if strange := [one for one in late if getattr(one, "sensor", None) != active.sensor]:
            self._broke(active.index, f"lets {strange[0]!r} arrive, which is no reading of `{active.sensor}`")
        return late

    def _reading(self, active: _Active, reading: Reading) -> Reading | None:
        disturbed = active.disturbance.reading(_kept(reading))
        if disturbed is not None and _signed(disturbed) != _signed(reading):
            what = f"makes {type(disturbed).__name__} of the {type(reading).__name__} of a sensor"
            self._broke(active.index, what)
        if disturbed is None or not _equal(disturbed, reading):
            self._count(active)
        return disturbed

    def _transmit(self, tick: int, command: Twist | None) -> None:
        """Pass the new command and delayed ones through the chain of faults; what remains reaches the base."""
        for active in self._at_work():
            if active.kind == COMMAND:
                late = active.disturbance.arriving_command()
                if late is not None:
                    self._check(active, late)
                fresh = None if command is None else self._commanded(active, command)
                command = late if fresh is None else fresh
        if command is not None:
            self._link.hear(tick, command)

    def _commanded(self, active: _Active, command: Twist) -> Twist | None:
        disturbed = active.disturbance.command(command)
        if disturbed is None and active.kind == COMMAND:
            self._count(active)
            return None
        disturbed = self._check(active, disturbed)
        if not np.allclose(disturbed, command, rtol=0.0, atol=ROUNDING):
            self._count(active)
        return disturbed

    def _check(self, active: _Active, command: object) -> Twist:
        if not isinstance(command, Twist) or not all(map(math.isfinite, command)):
            self._broke(active.index, f"makes {command!r} of a command")
        return command

    def _told(self, active: _Active, belief: Belief) -> Belief:
        told: object = active.disturbance.belief(belief)
        if not isinstance(told, Belief) or not all(map(math.isfinite, (*told.pose, *told.map_from_odom))):
            self._broke(active.index, f"makes {told!r} of a belief")
        if not np.allclose((*told.pose, *told.map_from_odom), (*belief.pose, *belief.map_from_odom), 0.0, ROUNDING):
            self._count(active)
        return told

    def _broke(self, index: int, what: str) -> NoReturn:
        entry = self._faults[index]
        raise RunError(BROKEN_COMPONENT, f"fault `{entry.label}` {what}{entry.added_by}")

    def _count(self, active: _Active) -> None:
        if active.over:
            return
        if not active.touched:
            entry = self._faults[active.index]
            self._note(Event(0, EventKind.FAULT_TOOK_EFFECT, entry.label, {"entry": active.index}))
        active.touched += 1


def _kept(reading: Reading) -> Reading:
    """Make the arrays of a reading read-only, so that a fault cannot change them in place unnoticed."""
    for array in (getattr(reading, field.name) for field in fields(reading)):
        if isinstance(array, np.ndarray):
            array.flags.writeable = False
    return reading


def _signed(reading: object) -> tuple[type, object]:
    return type(reading), getattr(reading, "sensor", None)


def _equal(one: Reading, other: Reading) -> bool:
    """Return whether two readings are equal except for rounding; nan equals nan."""
    if one is other:
        return True
    pairs = [(getattr(one, field.name), getattr(other, field.name)) for field in fields(one) if field.name != "sensor"]
    return all(
        a is b or (a is not None and b is not None and _is_close(a, b))  # a mount that is not tilted is None
        for a, b in pairs
    )


def _is_close(a: npt.ArrayLike, b: npt.ArrayLike) -> bool:
    return np.shape(a) == np.shape(b) and np.allclose(a, b, rtol=0.0, atol=ROUNDING, equal_nan=True)
