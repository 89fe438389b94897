"""Faults that make no sense on what they are written on."""

from collections.abc import Iterator, Mapping

from simscen.core.problems import Problem
from simscen.core.readings import BELIEF, COMMAND, INSTANCES, MAP, WHEELS
from simscen.faults.base import Instance
from simscen.loading.loaded import LoadedScenario
from simscen.loading.schema.messages import quoted, suggestion
from simscen.model.disturbances import FaultEntry
from simscen.model.robot import RobotSpec
from simscen.model.stack import StackSpec

WHAT = {
    COMMAND: "a velocity command",
    WHEELS: "wheels",
    BELIEF: "a localizer",
    MAP: "a map",
}
RESAMPLING_FAULTS = frozenset({"glass", "extrinsic"})
"""Faults that measure once more, which they can do only when the scan is taken."""


def unfit_faults(loaded: LoadedScenario) -> Iterator[Problem]:
    """Faults on what there is not, on what they cannot happen to, or whose keys mean nothing there."""
    if loaded.robot.spec is None:
        return
    known = instances(loaded, loaded.robot.spec)
    for index, entry in enumerate(loaded.spec.faults):
        instance = known.get(entry.sensor)
        if instance is None:
            message = f"robot `{loaded.robot.name}` has no sensor called {quoted(entry.sensor)}"
            yield loaded.problem(("faults", index, "sensor"), "SC031", message, suggestion(entry.sensor, known))
        elif instance.kind not in entry.fault.affects:
            fitting = [name for name, one in known.items() if one.kind in entry.fault.affects]
            hint = f"it can happen to: {', '.join(fitting)}" if fitting else "this robot has nothing it can happen to"
            what = WHAT.get(instance.kind) or _article(loaded.robot.spec.sensors[entry.sensor].kind)
            message = f"fault `{entry.kind}` makes no sense on {what} (`{entry.sensor}`)"
            yield loaded.problem_at(loaded.key_place_of("faults", index, entry.kind), "SC032", message, hint)
        elif why := entry.fault.senseless(instance):
            place = loaded.key_place_of("faults", index, entry.kind, *([why[0]] if why[0] else []))
            yield loaded.problem_at(
                place, "SC032", f"fault `{entry.kind}` makes no sense on `{entry.sensor}`: {why[1]}"
            )
        else:
            yield from _unreached(loaded, index, entry, instance.kind)
    yield from _seen_too_late(loaded, known)


def instances(loaded: LoadedScenario, robot: RobotSpec) -> Mapping[str, Instance]:
    """What faults can be written on, by name."""
    frequency = loaded.spec.stack.controller_frequency
    others = {
        name: Instance(kind, frequency if kind == COMMAND else 0.0, robot.drive if kind == WHEELS else None)
        for name, kind in INSTANCES.items()
    }
    sensors = {
        name: Instance(sensor.says, getattr(sensor.chosen, "rate", 0.0), sensor.chosen)
        for name, sensor in robot.sensors.items()
    }
    return {**sensors, **{name: other for name, other in others.items() if name not in sensors}}


def _unreached(loaded: LoadedScenario, index: int, entry: FaultEntry, kind: str) -> Iterator[Problem]:
    """Faults on the localizer of a stack that shows none, and on a map that is not there, or not for the whole run."""
    own = isinstance(loaded.spec.stack, StackSpec)
    if kind == BELIEF and not own:
        message = "simscen cannot come between the localizer and the navigator of a stack that is not its own"
        hint = "disturb what the localizer hears: odometry, lidar, imu, or the map"
        yield loaded.problem(("faults", index, "sensor"), "SC032", message, hint)
    if kind != MAP:
        return
    if loaded.spec.map == "none":
        message = "there is no map that could be wrong: the scenario says `map: none`"
        yield loaded.problem(("faults", index, "sensor"), "SC032", message)
    for key, given in (("when", entry.when), ("for", entry.for_)):
        if given is not None:
            message = f"a map has no `{key}`: the stack gets it once, before it starts"
            yield loaded.problem_at(loaded.key_place_of("faults", index, key), "SC032", message)


def _seen_too_late(loaded: LoadedScenario, known: Mapping[str, Instance]) -> Iterator[Problem]:
    """Faults that measure once more, behind one of the same sensor that keeps its scans back."""
    faults = loaded.spec.faults
    for index, entry in enumerate(faults):
        before = [one.label for one in faults[:index] if one.sensor == entry.sensor and one.kind in ("delay", "stuck")]
        sees = (
            entry.kind in RESAMPLING_FAULTS and entry.sensor in known and known[entry.sensor].kind in ("Scan", "Image")
        )
        if sees and before:
            message = f"`{entry.label}` would come too late: `{before[0]}` keeps back what it should change"
            place = loaded.key_place_of("faults", index, entry.kind)
            yield loaded.problem_at(place, "SC032", message, f"write it before `{before[0]}`: faults go in their order")


def _article(noun: str) -> str:
    return f"an {noun}" if noun[0] in "aeiou" else f"a {noun}"
