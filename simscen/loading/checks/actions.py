"""Checks for actions of events that are impossible or have no effect."""

from collections.abc import Iterator
from typing import Any

from simscen.loading.checks.registry import MEANING, CheckProblem
from simscen.loading.known_names import pedestrian_names
from simscen.loading.loaded import LoadedScenario
from simscen.loading.yaml.tree import Keys
from simscen.model.disturbances import SequenceStep

DOOR_MOVES = frozenset({"open", "close", "move", "teleport"})
"""Kinds of actions that can move a door."""


@MEANING.check("SC050")
def timed_stops_of_pedestrians(loaded: LoadedScenario) -> Iterator[CheckProblem]:
    """Find `stop` actions with a duration for pedestrians. A pedestrian does not walk on after a stop."""
    pedestrians = pedestrian_names(loaded)
    for step in loaded.spec.steps:
        for keys, action in step.located_actions():
            stop: Any = action.chosen
            if action.kind == "stop" and stop.for_ is not None and stop.name in pedestrians:
                message = f"`{step.name}` can never happen: pedestrian `{stop.name}` does not walk on after a stop"
                yield CheckProblem((*keys, "stop", "for"), message, "remove `for`", warning=not step.required)


def _zone_actions(loaded: LoadedScenario) -> list[tuple[SequenceStep, Keys, Any]]:
    """Return the step, the keys, and the specification of each action that enables or disables a zone."""
    return [
        (step, (*keys, action.kind), action.chosen)
        for step in loaded.spec.steps
        for keys, action in step.located_actions()
        if action.kind in ("keepout", "speed_zone") and loaded.includes_robot(action.robot)
    ]


@MEANING.check("SC050")
def speed_zones_without_limit(loaded: LoadedScenario) -> Iterator[CheckProblem]:
    """Find actions that enable a speed zone in a region for which nothing sets a speed limit."""
    actions = _zone_actions(loaded)
    limited = [zone.region for zone in loaded.spec.stack.speed_zones]
    limited += [action.region for _, _, action in actions if getattr(action, "speed_limit", None)]
    for step, keys, action in actions:
        if _limits_speed(keys, action) and action.region not in limited:
            message = f"`{step.name}` can never happen: region `{action.region}` has no speed limit"
            hint = "add a limit: `speed_limit: 0.3 m/s`"
            yield CheckProblem((*keys, "region"), message, hint, warning=not step.required)


@MEANING.check("SC055", severity="warning")
def speed_zones_without_effect(loaded: LoadedScenario) -> Iterator[CheckProblem]:
    """Find actions that set a speed limit of at least the top speed of the robot."""
    robot = loaded.robot.spec
    for _, keys, action in _zone_actions(loaded):
        if robot is None or not _limits_speed(keys, action):
            continue
        if action.speed_limit is not None and action.speed_limit >= robot.top_speed:
            message = f"the limit has no effect: the robot's top speed is {robot.top_speed:g} m/s"
            yield CheckProblem((*keys, "speed_limit"), message)


def _limits_speed(keys: Keys, action: Any) -> bool:
    """Return whether the zone action at `keys` enables a speed zone."""
    return keys[-1] == "speed_zone" and action.enabled and action.region is not None


@MEANING.check("SC033", severity="warning")
def replaced_friction_discs(loaded: LoadedScenario) -> Iterator[CheckProblem]:
    """Find discs of `friction` without a name that replace an earlier disc without a name at another place."""
    first: tuple[Keys, Any] | None = None
    for action_keys, action in (located for step in loaded.spec.steps for located in step.located_actions()):
        disc: Any = action.chosen
        if action.kind != "friction" or disc.at is None or "name" in disc.model_fields_set:
            continue
        keys = (*action_keys, "friction", "at")
        first = first or (keys, disc.at)
        if disc.at != first[1]:
            position = loaded.position_of(*first[0])
            message = f"this disc replaces the one at {position.line}:{position.col}: neither has a `name`"
            yield CheckProblem(keys, message, "give each of them a `name`")


@MEANING.check("SC055", severity="warning")
def pushes_without_effect(loaded: LoadedScenario) -> Iterator[CheckProblem]:
    """Find pushes of zero, pushes of objects without mass, and pushes of pedestrians."""
    world = loaded.world.spec
    spawned = [action.chosen for step in loaded.spec.steps for action in step.actions if action.kind == "spawn"]
    things = [*(world.objects if world else []), *spawned]
    doors = [door.name for door in world.doors] if world else []
    for step in loaded.spec.steps:
        for keys, action in step.located_actions():
            if action.kind != "push":
                continue
            push: Any = action.chosen
            if not any(push.impulse or push.force):
                key = "impulse" if push.force is None else "force"
                yield CheckProblem((*keys, "push", key), "a push of zero changes nothing")
            named: list[Any] = [thing for thing in things if getattr(thing, "name", "") == push.name]
            if push.name in doors or (named and not any(thing.mass for thing in named)):
                message = f"a push cannot move `{push.name}`, which has no mass"
                yield CheckProblem((*keys, "push", "name"), message, "give it a `mass`, or `move` it")
            elif push.name in pedestrian_names(loaded):
                message = f"a push cannot move pedestrian `{push.name}`"
                yield CheckProblem((*keys, "push", "name"), message, "use `stop`, `teleport` or `move`")


@MEANING.check("SC055", severity="warning")
def doors_already_in_state(loaded: LoadedScenario) -> Iterator[CheckProblem]:
    """Find actions that open or close a door that is in this state from the start, and that nothing else moves."""
    if loaded.world.spec is None or loaded.may_do():
        return
    located = [found for step in loaded.spec.steps for found in step.located_actions() if found[1].kind in DOOR_MOVES]
    for door in loaded.world.spec.doors:
        kind, opposite, state = ("close", "open", "closed") if door.closed else ("open", "close", "open")
        own = [(keys, action) for keys, action in located if getattr(action.chosen, "name", "") == door.name]
        if all(action.kind == kind and getattr(action.chosen, "to", 1) == 1 for _, action in own):
            message = f"door `{door.name}` is {state} from the start, and no event {opposite}s it"
            yield from (CheckProblem((*keys, kind, "name"), message) for keys, _ in own)
