"""Checks for events and faults that never happen or happen too rarely, and for actions without effect."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from simscen.loading.checks.possible_run import earliest_true_s, possible_run, stays_true
from simscen.loading.checks.registry import MEANING, CheckProblem
from simscen.loading.known_names import pedestrian_names
from simscen.loading.loaded import LoadedScenario

if TYPE_CHECKING:
    from simscen.model.disturbances import LocatedAction

DOOR_MOVES = frozenset({"open", "close", "move", "teleport"})
"""Kinds of actions that can move a door."""


@MEANING.check("SC050")
def impossible_triggers(loaded: LoadedScenario) -> Iterator[CheckProblem]:
    """Find events and faults that can never happen. With `required: false`, the problem is only a warning."""
    run = possible_run(loaded)
    for keys, trigger, name, required in run.triggers:
        if trigger is not None and (reason := run.why_never(trigger, keys)):
            yield CheckProblem(reason[0], f"`{name}` can never happen: {reason[1]}", warning=not required)


@MEANING.check("SC052", severity="warning")
def triggers_that_fire_once(loaded: LoadedScenario) -> Iterator[CheckProblem]:
    """Find events and faults with `times` above 1 that can happen only once."""
    run = possible_run(loaded)
    for keys, trigger, name, _ in run.triggers:
        if trigger is None or trigger.times == 1 or trigger.edge != "rising" or not stays_true(trigger):
            continue
        if run.why_never(trigger, keys) is None:
            message = f"`{name}` happens once, not {trigger.times} times: its condition stays true"
            yield CheckProblem((*keys, "times"), message)
    for index, fault in enumerate(loaded.spec.faults):
        if fault.when is not None and fault.when.times > 1 and fault.for_ is None:
            message = f"`{fault.label}` happens once, not {fault.when.times} times: without `for` it lasts to the end"
            yield CheckProblem(("faults", index, "when", "times"), message, "add `for`: how long it lasts")


@MEANING.check("SC050")
def impossible_steps(loaded: LoadedScenario) -> Iterator[CheckProblem]:
    """Find steps of a sequence that can only happen after the time limit, or that wait again for an earlier step."""
    run = possible_run(loaded)
    limit, earliest = loaded.spec.time_limit, dict[int, float]()
    for number, step in enumerate(run.steps):
        own = 0.0 if step.when is None or step.when.edge == "falling" else step.when.delay + earliest_true_s(step.when)
        earliest[number] = own + (0.0 if step.after is None else earliest[step.after])
        if step.after is None or not run.is_reachable(step) or step.when is None:
            continue
        keys = (*step.keys, "when")
        if earliest[number] >= limit > own and earliest[step.after] < limit:
            reason = f"its sequence takes at least {earliest[number]:g} s, but the time limit is {limit:g} s"
            yield CheckProblem(keys, f"`{step.name}` can never happen: {reason}", warning=not step.required)
        for part in step.when.walk():
            name = getattr(part.event, "name", None)
            if name in run.earlier_steps(step):
                message = f"`{step.name}` waits for `{name}`, which has already happened; a step waits for new events"
                yield CheckProblem(keys, message, warning=not step.required)


@MEANING.check("SC050")
def timed_stops_of_pedestrians(loaded: LoadedScenario) -> Iterator[CheckProblem]:
    """Find `stop` actions with a duration for pedestrians. A pedestrian does not walk on after a stop."""
    pedestrians = pedestrian_names(loaded)
    for one in (one for step in loaded.spec.steps for one in step.actions):
        if one.kind == "stop" and one.spec.for_ is not None and one.spec.name in pedestrians:
            reason = f"pedestrian `{one.spec.name}` does not walk on after a stop"
            message = f"`{one.step.name}` can never happen: {reason}"
            yield CheckProblem((*one.keys, "for"), message, "remove `for`", warning=not one.step.required)


@MEANING.check("SC050")
def speed_zones_without_limit(loaded: LoadedScenario) -> Iterator[CheckProblem]:
    """Find actions that enable a speed zone in a region for which nothing sets a speed limit."""
    limited = [zone.region for zone in loaded.spec.stack.speed_zones]
    limited += [one.spec.region for one in loaded.actions if one.kind == "speed_zone" and one.spec.speed_limit]
    for one in loaded.actions:
        if _limits_speed(one) and one.spec.region not in limited:
            message = f"`{one.step.name}` can never happen: region `{one.spec.region}` has no speed limit"
            hint = "add a limit: `speed_limit: 0.3 m/s`"
            yield CheckProblem((*one.keys, "region"), message, hint, warning=not one.step.required)


@MEANING.check("SC055", severity="warning")
def speed_zones_without_effect(loaded: LoadedScenario) -> Iterator[CheckProblem]:
    """Find actions that set a speed limit of at least the top speed of the robot."""
    robot = loaded.robot.spec
    for one in filter(_limits_speed, loaded.actions):
        if robot is not None and one.spec.speed_limit is not None and one.spec.speed_limit >= robot.top_speed:
            message = f"the limit has no effect: the robot's top speed is {robot.top_speed:g} m/s"
            yield CheckProblem((*one.keys, "speed_limit"), message)


def _limits_speed(one: LocatedAction) -> bool:
    """Return whether a zone action enables a speed zone."""
    return one.kind == "speed_zone" and one.spec.enabled and one.spec.region is not None


@MEANING.check("SC033", severity="warning")
def replaced_friction_discs(loaded: LoadedScenario) -> Iterator[CheckProblem]:
    """Find discs of `friction` without a name that replace an earlier disc without a name at another place."""
    patches = [one for step in loaded.spec.steps for one in step.actions if one.kind == "friction"]
    discs = [one for one in patches if one.spec.at is not None and "name" not in one.spec.model_fields_set]
    for one in discs:
        if one.spec.at != discs[0].spec.at:
            first = loaded.position_of(*discs[0].keys, "at")
            message = f"this disc replaces the one at {first.line}:{first.col}: neither has a `name`"
            yield CheckProblem((*one.keys, "at"), message, "give each of them a `name`")


@MEANING.check("SC055", severity="warning")
def pushes_without_effect(loaded: LoadedScenario) -> Iterator[CheckProblem]:
    """Find pushes of zero, pushes of objects without mass, and pushes of pedestrians."""
    world = loaded.world.spec
    actions = [one for step in loaded.spec.steps for one in step.actions]
    things = [*(world.objects if world else []), *(one.spec for one in actions if one.kind == "spawn")]
    doors = [door.name for door in world.doors] if world else []
    for one in actions:
        if one.kind != "push":
            continue
        push = one.spec
        if not any(push.impulse or push.force):
            key = "impulse" if push.force is None else "force"
            yield CheckProblem((*one.keys, key), "a push of zero changes nothing")
        named = [thing for thing in things if thing.name == push.name]
        if push.name in doors or (named and not any(thing.mass for thing in named)):
            message = f"a push cannot move `{push.name}`, which has no mass"
            yield CheckProblem((*one.keys, "name"), message, "give it a `mass`, or `move` it")
        elif push.name in pedestrian_names(loaded):
            message = f"a push cannot move pedestrian `{push.name}`"
            yield CheckProblem((*one.keys, "name"), message, "use `stop`, `teleport` or `move`")


@MEANING.check("SC055", severity="warning")
def doors_already_in_state(loaded: LoadedScenario) -> Iterator[CheckProblem]:
    """Find actions that open or close a door that is in this state from the start, and that nothing else moves."""
    if loaded.world.spec is None or loaded.may_do():
        return
    moves = [one for step in loaded.spec.steps for one in step.actions if one.kind in DOOR_MOVES]
    for door in loaded.world.spec.doors:
        kind, opposite, state = ("close", "open", "closed") if door.closed else ("open", "close", "open")
        own = [one for one in moves if one.spec.name == door.name]
        if all(one.kind == kind and getattr(one.spec, "to", 1) == 1 for one in own):
            message = f"door `{door.name}` is {state} from the start, and no event {opposite}s it"
            yield from (CheckProblem((*one.keys, "name"), message) for one in own)
