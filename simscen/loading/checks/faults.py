"""Checks for faults that cannot affect their sensor, cannot happen, or have no effect."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

from simscen.core.records.disturbances import BELIEF, COMMAND, KIND_BY_TARGET_NAME, MAP, WHEELS
from simscen.loading.checks.registry import MEANING, NAMES, CheckProblem, NameScope
from simscen.loading.codes import UNSUPPORTED_BY_STACK
from simscen.loading.loaded import LoadedScenario
from simscen.loading.schema.messages import quoted, suggestion
from simscen.model.robot import RobotSpec
from simscen.model.stack import StackSpec
from simscen.spec.quantities import with_article

if TYPE_CHECKING:
    from simscen.faults.base import FaultTarget
    from simscen.model.disturbances import FaultEntry
    from simscen.triggers.base import Trigger

TARGET_DESCRIPTIONS = {COMMAND: "a velocity command", WHEELS: "wheels", BELIEF: "a localizer", MAP: "a map"}
"""Descriptions for messages of fault targets other than sensors, by kind of the target."""


def fault_targets(loaded: LoadedScenario, robot: RobotSpec) -> Mapping[str, FaultTarget]:
    """Return all targets of faults by name: sensors of the robot, `cmd_vel`, `wheels`, and so on."""
    from simscen.faults.base import FaultTarget

    frequency = loaded.spec.stack.controller_frequency
    others = {
        name: FaultTarget(kind, frequency if kind == COMMAND else 0.0, robot.drive if kind == WHEELS else None)
        for name, kind in KIND_BY_TARGET_NAME.items()
    }
    sensors = {
        name: FaultTarget(sensor.reading_type, getattr(sensor.chosen, "rate", 0.0), sensor.chosen)
        for name, sensor in robot.sensors.items()
    }
    return {**sensors, **{name: other for name, other in others.items() if name not in sensors}}


def _listed_faults(loaded: LoadedScenario) -> Iterator[tuple[int, FaultEntry, Mapping[str, FaultTarget]]]:
    """Yield the index and the entry of each fault, and all targets; nothing if the sensors are not known yet."""
    if loaded.robot.spec is not None and loaded.spec.faults:
        targets = fault_targets(loaded, loaded.robot.spec)
        for index, entry in enumerate(loaded.spec.faults):
            yield index, entry, targets


@NAMES.check("SC031")
def unknown_sensors(scope: NameScope) -> Iterator[CheckProblem]:
    """Find faults of a sensor that the robot does not have."""
    loaded = scope.loaded
    for index, entry, targets in _listed_faults(loaded):
        if entry.sensor not in targets:
            hint = suggestion(entry.sensor, targets)
            message = f"robot `{loaded.robot.name}` has no sensor called {quoted(entry.sensor)}"
            yield CheckProblem(("faults", index, "sensor"), message, hint)


@NAMES.check("SC032")
def unsuitable_faults(scope: NameScope) -> Iterator[CheckProblem]:
    """Find faults that cannot affect their target, and faults with values that do not fit the target."""
    loaded = scope.loaded
    for index, entry, targets in _listed_faults(loaded):
        target = targets.get(entry.sensor)
        if target is None:
            continue
        keys = ("faults", index, entry.kind)
        if target.kind not in entry.fault.affects:
            assert loaded.robot.spec is not None
            suitable = [name for name, other in targets.items() if other.kind in entry.fault.affects]
            hint = f"it can affect: {', '.join(suitable)}" if suitable else "it can affect nothing on this robot"
            sensor = TARGET_DESCRIPTIONS.get(target.kind) or with_article(loaded.robot.spec.sensors[entry.sensor].kind)
            message = f"fault `{entry.kind}` cannot affect {sensor} (`{entry.sensor}`)"
            yield CheckProblem(keys, message, hint, at_key=True)
        elif unsuitable := entry.fault.unsuitable_key(target):
            key, reason = unsuitable
            message = f"fault `{entry.kind}` does not fit `{entry.sensor}`: {reason}"
            yield CheckProblem((*keys, key) if key else keys, message, at_key=True)


@NAMES.check("SC032")
def impossible_map_faults(scope: NameScope) -> Iterator[CheckProblem]:
    """Find map faults in scenarios without a map, and map faults with `when` or `for`."""
    loaded = scope.loaded
    for index, entry, target in _suitable_faults(loaded):
        if target.kind != MAP:
            continue
        if loaded.spec.map == "none":
            message = "the map cannot have faults: the scenario has `map: none`"
            yield CheckProblem(("faults", index, "sensor"), message)
        for key, given in (("when", entry.when), ("for", entry.for_)):
            if given is not None:
                message = f"a fault on the map cannot have `{key}`: the stack gets the map once, before it starts"
                yield CheckProblem(("faults", index, key), message, at_key=True)


@NAMES.check(UNSUPPORTED_BY_STACK)
def faults_of_foreign_localizers(scope: NameScope) -> Iterator[CheckProblem]:
    """Find faults of the localizer for stacks that simscen does not ship."""
    if isinstance(scope.loaded.spec.stack, StackSpec):
        return
    for index, _, target in _suitable_faults(scope.loaded):
        if target.kind == BELIEF:
            message = "only the localizer of simscen's own stacks can have faults"
            hint = "disturb the inputs of the localizer instead: odometry, lidar, imu, or the map"
            yield CheckProblem(("faults", index, "sensor"), message, hint)


def _suitable_faults(loaded: LoadedScenario) -> Iterator[tuple[int, FaultEntry, FaultTarget]]:
    """Yield the index, the entry, and the target of each fault that can affect its target."""
    for index, entry, targets in _listed_faults(loaded):
        target = targets.get(entry.sensor)
        if target is not None and target.kind in entry.fault.affects and not entry.fault.unsuitable_key(target):
            yield index, entry, target


@MEANING.check("SC050")
def faults_between_messages(loaded: LoadedScenario) -> Iterator[CheckProblem]:
    """Find faults that can begin and end between two messages of the sensor, so that they have no effect."""
    if loaded.robot.spec is None:
        return
    rates = {name: getattr(sensor.chosen, "rate", None) for name, sensor in loaded.robot.spec.sensors.items()}
    rates["cmd_vel"] = loaded.spec.stack.controller_frequency
    for index, entry in enumerate(loaded.spec.faults):
        rate = rates.get(entry.sensor)
        if entry.for_ is None or rate is None or entry.for_ * rate >= 1 - 1e-9:
            continue
        begin = _start_time_s(entry.when)
        is_between = begin is not None and math.ceil(begin * rate - 1e-6) > (begin + entry.for_) * rate + 1e-6
        if begin is None or is_between:
            verb = "begins and ends" if is_between else "may begin and end"
            message = f"`{entry.label}` {verb} between two messages: `{entry.sensor}` sends {rate:g} per second"
            hint = f"make it last at least {1 / rate:g} s"
            yield CheckProblem(("faults", index, "for"), message, hint, is_warning=not (is_between and entry.required))


def _start_time_s(when: Trigger | None) -> float | None:
    """Return the time in s at which a fault begins; None if it does not depend on the time alone."""
    if when is None:
        return 0.0
    return float(when.chosen.root) + when.delay if when.time is not None else None


@MEANING.check("SC055", severity="warning")
def faults_without_effect(loaded: LoadedScenario) -> Iterator[CheckProblem]:
    """Find faults with values that have no effect, such as a noise of 0."""
    for index, entry in enumerate(loaded.spec.faults):
        neutral = entry.fault.neutral_values
        if neutral and all(getattr(entry.chosen, key) == value for key, value in neutral.items()):
            message = f"fault `{entry.label}` changes nothing with these values"
            yield CheckProblem(("faults", index, entry.kind), message, at_key=True)
