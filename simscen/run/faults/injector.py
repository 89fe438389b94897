"""Inject the faults of a robot into its readings, beliefs (pose estimates), and commands during a run.

Several faults of one sensor or actuator form a chain in the order of the scenario: each fault receives the output of
the previous fault. Faults that simulate measurements again (`Fault.measures_again`) come first.
"""

import math
from collections import Counter
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, fields, replace
from typing import NoReturn

import numpy as np
import numpy.typing as npt

from simscen.core.errors import BROKEN_COMPONENT, RunError
from simscen.core.geometry.kinematics import Twist
from simscen.core.messages.navigation import Belief
from simscen.core.messages.sensor_data import Odometry, Reading, Readings
from simscen.core.random_streams import Streams
from simscen.core.records.disturbances import BELIEF, COMMAND, WHEELS
from simscen.core.records.events import Event, EventKind
from simscen.faults.base import FaultEffect, FaultSetting
from simscen.model.disturbances import FaultEntry
from simscen.run.faults.command_link import CommandLink
from simscen.run.stream_names import stream_names
from simscen.stack.localizers.ground_truth import TRUTH

MAX_ROUNDING_ERROR = 1e-9
"""Largest change of a number that counts as rounding, not as an effect of a fault."""


@dataclass
class _ActiveFault:
    """A fault that is active, or that has ended but still has an effect: delayed messages, or an error of odometry.

    index:          index of the fault in the scenario
    sensor:         name of the target (the affected sensor or actuator)
    kind:           kind of the target: class of its readings, such as "Scan", or COMMAND, WHEELS, BELIEF, or MAP
    effect:         implementation of the fault
    measures_again: whether the effect is applied to measurements, before the latency of the sensor
    changed_count:  number of messages that the fault has changed or withheld
    has_ended:      whether the fault has ended
    """

    index: int
    sensor: str
    kind: str
    effect: FaultEffect
    measures_again: bool
    changed_count: int = 0
    has_ended: bool = False

    def affects(self, reading: Reading) -> bool:
        """Return whether a reading is from the target. A fault of the wheels affects all wheel odometry."""
        if self.kind == WHEELS:
            return isinstance(reading, Odometry) and reading.sensor != TRUTH
        return reading.sensor == self.sensor


class FaultInjector:
    """Applies the active faults of one robot to its readings, commands, and beliefs."""

    def __init__(
        self,
        faults: list[FaultEntry],
        streams: Streams,
        setting: Callable[[FaultEntry], FaultSetting],
        link: CommandLink,
        emit: Callable[[Event], None],
        map_faults: Collection[int] = (),
    ) -> None:
        """Prepare the `faults` of a scenario. A fault is inactive until `begin`.

        `setting` returns information about the target of a fault. `link` transmits commands to the base. `emit`
        receives an event when a fault changes its first message. `map_faults` are the indices of the faults that
        changed the map before the run.
        """
        self._map_faults = set(map_faults)
        self._faults, self._streams, self._setting, self._link, self._emit = faults, streams, setting, link, emit
        self._names = stream_names(faults)
        self.has_faults = bool(faults)
        """Whether the robot has any fault."""
        self._activations: Counter[int] = Counter()
        self.active: dict[tuple[int, int], _ActiveFault] = {}
        """Active faults by index and number of the activation, because an ended activation can still have an effect."""
        self._affects_commands = False
        self._last_belief: tuple[int, Belief, Belief] | None = None
        """Tick, belief, and disturbed belief of the last call of `belief`."""

    def begin(self, index: int) -> str:
        """Start the fault with this index; return the kind of its target, such as "Scan"."""
        entry = self._faults[index]
        self._activations[index] += 1
        rng = self._streams.generator(f"fault{self._names[index]}#{self._activations[index]}")
        setting = self._setting(entry)
        setting = replace(setting, command=self._link.active_command(setting.now()))
        effect: object = entry.fault.begin(rng, setting)
        if not isinstance(effect, FaultEffect):
            self._raise_invalid(index, f"returned {effect!r} from `begin`, which is not a FaultEffect")
        self.active[index, self._activations[index]] = _ActiveFault(
            index, entry.sensor, setting.kind, effect, entry.fault.measures_again
        )
        self._affects_commands = self._affects_commands or setting.kind == COMMAND
        return setting.kind

    def end(self, index: int) -> int:
        """End a fault, and return the number of messages that it changed. Messages that it has delayed arrive later."""
        key = index, self._activations[index]
        active = self.active.pop(key)
        if remaining := active.effect.end():
            self.active[key] = replace(active, effect=remaining, has_ended=True)
        return active.changed_count

    def measure(self, reading: Reading) -> Reading:
        """Return the measurement that a sensor with faults makes instead of `reading`. Call it at each measurement."""
        for active in self._in_order() if self.active else ():
            if active.measures_again and active.affects(reading):
                disturbed = self._disturb_reading(active, reading)
                if disturbed is None:
                    self._raise_invalid(active.index, "withheld a measurement, although it `measures_again`")
                reading = disturbed
        return reading

    def disturb(self, readings: Readings) -> Readings:
        """Return the readings that the stack receives: disturbed readings, and delayed readings that arrive now."""
        for active in self._in_order():
            if active.measures_again:
                continue
            if active.index in self._map_faults:
                self._map_faults.remove(active.index)
                self._count_change(active)
            delayed = self._delayed_readings(active)
            disturbed = (
                self._disturb_reading(active, reading) if active.affects(reading) else reading for reading in readings
            )
            readings = (*delayed, *(reading for reading in disturbed if reading is not None))
        return readings

    def command(self, tick: int, command: Twist) -> Twist:
        """Send the stack's command to the base, and return the command that the wheels execute.

        Faults of cmd_vel change the message to the base. Faults of the wheels change what the wheels execute. Call it
        exactly once at each beat of the robot (tick at which a sensor, the stack, or a truth sample is due).
        """
        is_sent = self._link.send(tick, command)
        if self._affects_commands:
            self._transmit_command(tick, command if is_sent else None)
            command = self._link.active_command(tick)
        elif is_sent:
            self._link.receive(tick, command)
        for active in self._in_order():
            if active.kind == WHEELS or active.effect.changes_motion:
                command = self._disturb_command(active, command) or command
        return command

    def belief(self, tick: int, belief: Belief) -> Belief:
        """Return the belief that the navigator receives: `belief`, changed by the faults of the localizer."""
        if not any(active.kind == BELIEF for active in self.active.values()):
            return belief
        if self._last_belief is None or self._last_belief[:2] != (tick, belief):
            disturbed = belief
            for active in self._in_order():
                if active.kind == BELIEF:
                    disturbed = self._disturb_belief(active, disturbed)
            self._last_belief = tick, belief, disturbed
        return self._last_belief[2]

    def _in_order(self) -> list[_ActiveFault]:
        """Return the active faults in the order of the scenario."""
        return [self.active[key] for key in sorted(self.active)]

    def _delayed_readings(self, active: _ActiveFault) -> Sequence[Reading]:
        """Return the delayed readings that arrive now. Raises RunError if the fault returns anything else."""
        arriving: object = active.effect.arriving_readings()
        if not isinstance(arriving, list | tuple):
            self._raise_invalid(
                active.index,
                f"returned {arriving!r} from `arriving_readings`, not a list or tuple of readings",
            )
        if invalid := [reading for reading in arriving if getattr(reading, "sensor", None) != active.sensor]:
            self._raise_invalid(
                active.index,
                f"returned {invalid[0]!r} from `arriving_readings`, not a reading of `{active.sensor}`",
            )
        return arriving

    def _disturb_reading(self, active: _ActiveFault, reading: Reading) -> Reading | None:
        """Return the disturbed reading, or None if the fault withholds it. Raises RunError if it is invalid."""
        disturbed = active.effect.reading(_read_only(reading))
        if disturbed is not None and _type_and_sensor(disturbed) != _type_and_sensor(reading):
            problem = f"returned an object of type {type(disturbed).__name__} for a {type(reading).__name__} reading"
            self._raise_invalid(active.index, problem)
        if disturbed is None or not _is_equal(disturbed, reading):
            self._count_change(active)
        return disturbed

    def _transmit_command(self, tick: int, command: Twist | None) -> None:
        """Send a command (None: no new command) through all faults of cmd_vel to the base."""
        for active in self._in_order():
            if active.kind == COMMAND:
                delayed = active.effect.arriving_command()
                if delayed is not None:
                    self._require_finite_command(active, delayed)
                disturbed = None if command is None else self._disturb_command(active, command)
                command = delayed if disturbed is None else disturbed
        if command is not None:
            self._link.receive(tick, command)

    def _disturb_command(self, active: _ActiveFault, command: Twist) -> Twist | None:
        """Return the disturbed command, or None if the fault withholds it. Raises RunError if it is invalid."""
        disturbed = active.effect.command(command)
        if disturbed is None and active.kind == COMMAND:
            self._count_change(active)
            return None
        disturbed = self._require_finite_command(active, disturbed)
        if not np.allclose(disturbed, command, rtol=0.0, atol=MAX_ROUNDING_ERROR):
            self._count_change(active)
        return disturbed

    def _require_finite_command(self, active: _ActiveFault, command: object) -> Twist:
        if not isinstance(command, Twist) or not all(map(math.isfinite, command)):
            self._raise_invalid(active.index, f"returned {command!r} for a command, which is not a finite Twist")
        return command

    def _disturb_belief(self, active: _ActiveFault, belief: Belief) -> Belief:
        disturbed: object = active.effect.belief(belief)
        if not isinstance(disturbed, Belief) or not all(
            map(math.isfinite, (*disturbed.pose, *disturbed.map_from_odom))
        ):
            self._raise_invalid(active.index, f"returned {disturbed!r} for a belief, which is not a finite Belief")
        if not np.allclose(
            (*disturbed.pose, *disturbed.map_from_odom), (*belief.pose, *belief.map_from_odom), 0.0, MAX_ROUNDING_ERROR
        ):
            self._count_change(active)
        return disturbed

    def _raise_invalid(self, index: int, problem: str) -> NoReturn:
        entry = self._faults[index]
        raise RunError(BROKEN_COMPONENT, f"fault `{entry.label}` {problem}{entry.plugin_suffix}")

    def _count_change(self, active: _ActiveFault) -> None:
        """Count a change by a fault, and emit an event for the first change."""
        if active.has_ended:
            return
        if not active.changed_count:
            entry = self._faults[active.index]
            self._emit(Event(0, EventKind.FAULT_TOOK_EFFECT, entry.label, {"entry": active.index}))
        active.changed_count += 1


def _read_only(reading: Reading) -> Reading:
    """Make the arrays of a reading read-only, so that a fault cannot change them in place."""
    for array in (getattr(reading, field.name) for field in fields(reading)):
        if isinstance(array, np.ndarray):
            array.flags.writeable = False
    return reading


def _type_and_sensor(reading: object) -> tuple[type, object]:
    return type(reading), getattr(reading, "sensor", None)


def _is_equal(first: Reading, second: Reading) -> bool:
    """Return whether two readings of a sensor are equal except for rounding; nan equals nan."""
    if first is second:
        return True
    names = [field.name for field in fields(first) if field.name != "sensor"]
    pairs = [(getattr(first, name), getattr(second, name)) for name in names]
    return all(
        a is b or (a is not None and b is not None and _is_close(a, b))  # a mount that is not tilted is None
        for a, b in pairs
    )


def _is_close(a: npt.ArrayLike, b: npt.ArrayLike) -> bool:
    return np.shape(a) == np.shape(b) and np.allclose(a, b, rtol=0.0, atol=MAX_ROUNDING_ERROR, equal_nan=True)
