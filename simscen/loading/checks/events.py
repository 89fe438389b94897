"""Checks for events and faults that never happen, or less often than stated, and for actions without effect."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

from simscen.loading.checks.event_feasibility import analyze_events, earliest_true_s, stays_true
from simscen.loading.checks.registry import MEANING, CheckProblem
from simscen.loading.known_names import pedestrian_names
from simscen.loading.loaded import LoadedScenario

if TYPE_CHECKING:
    from simscen.model.disturbances import LocatedAction
    from simscen.triggers.base import Trigger

DOOR_MOVES = frozenset({"open", "close", "move", "teleport"})
"""Kinds of actions that can move a door."""


@MEANING.check("SC050")
def impossible_triggers(loaded: LoadedScenario) -> Iterator[CheckProblem]:
    """Find events and faults that can never happen. With `required: false`, the problem is only a warning."""
    analysis = analyze_events(loaded)
    for keys, trigger, name, required in analysis.triggers:
        if trigger is not None and (reason := analysis.infeasibility(trigger, keys)):
            yield CheckProblem(reason[0], f"`{name}` can never happen: {reason[1]}", is_warning=not required)


@MEANING.check("SC052", severity="warning")
def triggers_that_fire_once(loaded: LoadedScenario) -> Iterator[CheckProblem]:
    """Find events and faults with `times` above 1 that can happen only once."""
    analysis = analyze_events(loaded)
    for keys, trigger, name, _ in analysis.triggers:
        if trigger is None or trigger.times == 1 or trigger.edge != "rising" or not stays_true(trigger):
            continue
        if analysis.infeasibility(trigger, keys) is None:
            message = f"`{name}` happens once, not {trigger.times} times: its condition stays true"
            yield CheckProblem((*keys, "times"), message)
    for index, fault in enumerate(loaded.spec.faults):
        if fault.when is not None and fault.when.times > 1 and fault.for_ is None:
            message = f"`{fault.label}` happens once, not {fault.when.times} times: without `for` it lasts to the end"
            yield CheckProblem(("faults", index, "when", "times"), message, "add `for`: how long it lasts")


@MEANING.check("SC050")
def impossible_steps(loaded: LoadedScenario) -> Iterator[CheckProblem]:
    """Find steps of a sequence that cannot happen before the time limit, or that wait for an earlier step again."""
    analysis = analyze_events(loaded)
    limit, earliest = loaded.spec.time_limit, dict[int, float]()
    for number, step in enumerate(analysis.steps):
        wait = _min_wait_s(step.when)
        earliest[number] = wait + (0.0 if step.after is None else earliest[step.after])
        if step.after is None or not analysis.is_reachable(step) or step.when is None:
            continue
        keys = (*step.keys, "when")
        if earliest[number] >= limit > wait and earliest[step.after] < limit:
            reason = f"its sequence takes at least {earliest[number]:g} s, but the time limit is {limit:g} s"
            yield CheckProblem(keys, f"`{step.name}` can never happen: {reason}", is_warning=not step.required)
        for part in step.when.walk():
            name = getattr(part.event, "name", None)
            if name in analysis.earlier_steps(step):
                message = f"`{step.name}` waits for `{name}`, which has already happened; a step waits for new events"
                yield CheckProblem(keys, message, is_warning=not step.required)


def _min_wait_s(when: Trigger | None) -> float:
    """Return a lower bound on the time in s from the previous step, or from the start of the run, to a step."""
    return 0.0 if when is None or when.edge == "falling" else when.delay + earliest_true_s(when)


@MEANING.check("SC050")
def timed_stops_of_pedestrians(loaded: LoadedScenario) -> Iterator[CheckProblem]:
    """Find `stop` actions with a duration for pedestrians. A pedestrian does not walk on after a stop."""
    pedestrians = pedestrian_names(loaded)
    for action in loaded.all_actions:
        if action.kind == "stop" and action.spec.for_ is not None and action.spec.name in pedestrians:
            reason = f"pedestrian `{action.spec.name}` does not walk on after a stop"
            message = f"`{action.step.name}` can never happen: {reason}"
            yield CheckProblem((*action.keys, "for"), message, "remove `for`", is_warning=not action.step.required)


@MEANING.check("SC050")
def speed_zones_without_limit(loaded: LoadedScenario) -> Iterator[CheckProblem]:
    """Find actions that enable a speed zone in a region for which nothing sets a speed limit."""
    limited = [zone.region for zone in loaded.spec.stack.speed_zones]
    zone_actions = [action for action in loaded.actions if action.kind == "speed_zone"]
    limited += [action.spec.region for action in zone_actions if action.spec.speed_limit]
    for action in zone_actions:
        if _enables_speed_zone(action) and action.spec.region not in limited:
            message = f"`{action.step.name}` can never happen: region `{action.spec.region}` has no speed limit"
            hint = "add a limit: `speed_limit: 0.3 m/s`"
            yield CheckProblem((*action.keys, "region"), message, hint, is_warning=not action.step.required)


@MEANING.check("SC055", severity="warning")
def speed_zones_without_effect(loaded: LoadedScenario) -> Iterator[CheckProblem]:
    """Find actions that set a speed limit of at least the top speed of the robot."""
    robot = loaded.robot.spec
    for action in filter(_enables_speed_zone, loaded.actions):
        if robot is not None and action.spec.speed_limit is not None and action.spec.speed_limit >= robot.top_speed:
            message = f"the limit has no effect: the robot's top speed is {robot.top_speed:g} m/s"
            yield CheckProblem((*action.keys, "speed_limit"), message)


def _enables_speed_zone(action: LocatedAction) -> bool:
    """Return whether an action enables a speed zone."""
    return action.kind == "speed_zone" and action.spec.enabled and action.spec.region is not None


@MEANING.check("SC033", severity="warning")
def replaced_friction_discs(loaded: LoadedScenario) -> Iterator[CheckProblem]:
    """Find discs of `friction` without a name that replace an earlier disc without a name at another place."""
    patches = [action for action in loaded.all_actions if action.kind == "friction"]
    discs = [action for action in patches if action.spec.at is not None and "name" not in action.spec.model_fields_set]
    for action in discs:
        if action.spec.at != discs[0].spec.at:
            first = loaded.position_of(*discs[0].keys, "at")
            message = f"this disc replaces the one at {first.line}:{first.col}: neither has a `name`"
            yield CheckProblem((*action.keys, "at"), message, "give each of them a `name`")


@MEANING.check("SC055", severity="warning")
def pushes_without_effect(loaded: LoadedScenario) -> Iterator[CheckProblem]:
    """Find pushes of zero, pushes of objects without mass, and pushes of pedestrians."""
    world = loaded.world.spec
    actions = loaded.all_actions
    objects = [*(world.objects if world else []), *(action.spec for action in actions if action.kind == "spawn")]
    doors = [door.name for door in world.doors] if world else []
    for action in actions:
        if action.kind != "push":
            continue
        push = action.spec
        if not any(push.impulse or push.force):
            key = "impulse" if push.force is None else "force"
            yield CheckProblem((*action.keys, key), "a push of zero changes nothing")
        masses = [pushed.mass for pushed in objects if pushed.name == push.name]
        if push.name in doors or (masses and not any(masses)):
            message = f"a push cannot move `{push.name}`, which has no mass"
            yield CheckProblem((*action.keys, "name"), message, "give it a `mass`, or `move` it")
        elif push.name in pedestrian_names(loaded):
            message = f"a push cannot move pedestrian `{push.name}`"
            yield CheckProblem((*action.keys, "name"), message, "use `stop`, `teleport` or `move`")


@MEANING.check("SC055", severity="warning")
def doors_already_in_state(loaded: LoadedScenario) -> Iterator[CheckProblem]:
    """Find actions that open an open door or close a closed door, if no other action moves the door."""
    if loaded.world.spec is None or loaded.may_do():
        return
    moves = [action for action in loaded.all_actions if action.kind in DOOR_MOVES]
    for door in loaded.world.spec.doors:
        kind, opposite, state = ("close", "open", "closed") if door.closed else ("open", "close", "open")
        door_moves = [action for action in moves if action.spec.name == door.name]
        if all(action.kind == kind and getattr(action.spec, "to", 1) == 1 for action in door_moves):
            message = f"door `{door.name}` is {state} from the start, and no event {opposite}s it"
            yield from (CheckProblem((*action.keys, "name"), message) for action in door_moves)
