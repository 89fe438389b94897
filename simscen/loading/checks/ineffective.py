"""What is valid and deserves a look: bounds that nothing can break, and entries that change nothing. All are warnings.

A bound counts as loose when physics or the time limit keep it already.
"""

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

from pydantic import BaseModel

from simscen.core.problems import Problem
from simscen.loading.checks.events import top_speed
from simscen.loading.known_names import pedestrian_names
from simscen.loading.loaded import LoadedScenario
from simscen.loading.spec_walk import quantities_of
from simscen.loading.yaml.tree import Key, MappingNode, Node, ScalarNode, node_at

Keys = tuple[Key, ...]
Looseness = Iterator[tuple[str, str]]
"""Keys of a criterion's bounds, and why nothing can break them."""

FASTER = 1.2
"""Times its top speed that a bound on the speed may be: an overshoot is worth a bound."""
DETOUR = 10.0
"""Times the shortest way: nobody drives so far by mistake."""
MANY = 1000
"""Collisions: more than any run has seen."""
TURN = 2 * math.pi
LATENCY_HINT = "write one into a *.robot.yaml, or the durations here"


def hardly_fails(loaded: LoadedScenario) -> Iterator[Problem]:
    """Every warning about a scenario's text."""
    for check in (_loose, _only_warnings, _late_timeouts, _degrees, _twice, _idle_faults, _idle_stack, _idle_actions):
        for problem in check(loaded):
            yield replace(problem, severity="warning")


def _loose(loaded: LoadedScenario) -> Iterator[Problem]:
    for index, entry in enumerate(loaded.spec.pass_):
        check = _BOUNDS.get(entry.kind)
        for key, why in check(loaded, entry.chosen) if check else ():
            keys = ("pass", index, entry.kind, key)
            yield loaded.problem(keys, "SC052", f"{entry.kind} can hardly fail: {why}")


def _speed(loaded: LoadedScenario, speed: Any) -> Looseness:
    robot = loaded.robot.spec
    if robot is None:
        return
    if speed.max is not None and speed.max > FASTER * top_speed(robot):
        yield "max", f"the robot's top speed is {top_speed(robot):g} m/s"
    if speed.max_turn_rate is not None and speed.max_turn_rate > FASTER * robot.limits.angular:
        yield "max_turn_rate", f"the robot turns at {robot.limits.angular:g} rad/s at most"


def _path_length(loaded: LoadedScenario, length: Any) -> Looseness:
    robot, limit = loaded.robot.spec, loaded.spec.time_limit
    if length.max_ratio is not None and length.max_ratio > DETOUR:
        yield "max_ratio", f"that is {length.max_ratio:g} times the shortest way"
    if robot is not None and length.max is not None and length.max > top_speed(robot) * limit:
        yield "max", f"at its top speed the robot drives {top_speed(robot) * limit:g} m within the time limit"


def _collisions(_: LoadedScenario, collisions: Any) -> Looseness:
    if collisions.max is not None and collisions.max >= MANY:
        yield "max", f"{collisions.max} collisions are more than a run has"


def _goals_reached(loaded: LoadedScenario, reached: Any) -> Looseness:
    yield from _beyond_limit(loaded, reached, "within")
    timeouts = [goal.timeout for goal in loaded.spec.goals]
    own = [timeout for timeout in timeouts if timeout is not None]
    if reached.within is not None and own and len(own) == len(timeouts) and reached.within > max(own):
        yield "within", f"the goals' own timeouts end them after {max(own):g} s at most"


def _beyond_limit(loaded: LoadedScenario, criterion: Any, key: str) -> Looseness:
    value, limit = getattr(criterion, key), loaded.spec.time_limit
    if value is not None and value >= limit:
        yield key, f"the time limit ends the run after {limit:g} s"


def _within_limit(key: str) -> Callable[[LoadedScenario, Any], Looseness]:
    return lambda loaded, criterion: _beyond_limit(loaded, criterion, key)


_BOUNDS: dict[str, Callable[[LoadedScenario, Any], Looseness]] = {
    "speed": _speed,
    "path_length": _path_length,
    "collisions": _collisions,
    "goals_reached": _goals_reached,
    "time_to_goal": _within_limit("max"),
    "stuck": _within_limit("max"),
    "stopped_within": _within_limit("time"),
    "relocalized_within": _within_limit("time"),
}


def _only_warnings(loaded: LoadedScenario) -> Iterator[Problem]:
    if all(entry.severity == "warn" for entry in loaded.spec.pass_):
        message = "no criterion can fail the run: all are `severity: warn`"
        yield loaded.problem_at(loaded.key_place_of("pass"), "SC052", message)


def _late_timeouts(loaded: LoadedScenario) -> Iterator[Problem]:
    limit = loaded.spec.time_limit
    for index, (goal, name) in enumerate(zip(loaded.spec.goals, loaded.spec.goal_names, strict=True)):
        if goal.timeout is not None and goal.timeout > limit:
            message = f"goal `{name}` never times out: the time limit ends the run after {limit:g} s"
            yield loaded.problem(("goals", index, "timeout"), "SC052", message)


def _degrees(loaded: LoadedScenario) -> Iterator[Problem]:
    """Bare angles of more than a turn, in the scenario, in its world, and in its robot unless it ships with simscen."""
    trees: list[tuple[BaseModel | None, MappingNode | None]] = [
        (loaded.spec, loaded.tree),
        (loaded.world.spec, loaded.world.tree),
    ]
    if not loaded.robot.bundled:
        trees.append((loaded.robot.spec, loaded.robot.tree))
    for spec, tree in trees:
        for keys, value in quantities_of(spec, "angle") if spec is not None and tree is not None else ():
            node: Node = node_at(tree, keys) if tree is not None else loaded.tree
            bare = isinstance(node, ScalarNode) and isinstance(node.value, int | float)
            if bare and abs(value) > TURN + 1e-3:
                message = f"`{keys[-1]}: {value:g}` is {value / TURN:.1f} turns: angles without a unit are radians"
                yield loaded.problem_at(node.place, "SC053", message, f"did you mean `{value:g} deg`?")


def _twice(loaded: LoadedScenario) -> Iterator[Problem]:
    """The same entry twice in one list."""
    spec = loaded.spec
    lists: list[tuple[Keys, list[Any]]] = [
        (("pass",), [(entry.kind, entry.chosen) for entry in spec.pass_]),
        (("events",), [(event.when, event.do, event.then) for event in spec.events]),
        (("faults",), [(f.sensor, f.kind, f.chosen, f.when, f.for_) for f in spec.faults]),
        (("tags",), list(spec.tags)),
        (("stack", "keepout"), list(spec.stack.keepout)),
        (("stack", "speed_zones"), [zone.region for zone in spec.stack.speed_zones]),
    ]
    for keys, entries in lists:
        for index, entry in enumerate(entries):
            if entry in entries[:index]:
                first = loaded.place_of(*keys, entries.index(entry))
                message = f"the same is in `{keys[-1]}` already (first at {first.line}:{first.col})"
                yield loaded.problem((*keys, index), "SC054", message)


def _idle_faults(loaded: LoadedScenario) -> Iterator[Problem]:
    for index, entry in enumerate(loaded.spec.faults):
        idle = entry.fault.idle
        if idle and all(getattr(entry.chosen, key) == value for key, value in idle.items()):
            place = loaded.key_place_of("faults", index, entry.kind)
            yield loaded.problem_at(place, "SC055", f"fault `{entry.label}` changes nothing with these values")


def _idle_stack(loaded: LoadedScenario) -> Iterator[Problem]:
    robot, stack = loaded.robot.spec, loaded.spec.stack
    if getattr(stack, "latency", None) == "robot" and (robot is None or "latency" not in robot.model_fields_set):
        message = f"the file of robot `{loaded.robot.name}` says no `latency`: computing takes no time"
        yield loaded.problem(("stack", "latency"), "SC055", message, LATENCY_HINT)
    if robot is None:
        return
    fastest = top_speed(robot)
    for index, zone in enumerate(stack.speed_zones):
        if zone.speed_limit >= fastest:
            message = f"no limit: the robot's top speed is {fastest:g} m/s"
            yield loaded.problem(("stack", "speed_zones", index, "speed_limit"), "SC055", message)
    for key in ("desired_linear_vel", "max_vel_x", "vx_max"):
        wanted = getattr(getattr(stack, "controller", None), key, None)
        if isinstance(wanted, int | float) and wanted > robot.limits.linear:
            message = f"{wanted:g} m/s is never reached: the robot's top speed is {robot.limits.linear:g} m/s"
            yield loaded.problem(("stack", "controller", key), "SC055", message)


def _idle_push(loaded: LoadedScenario, keys: Keys, push: Any) -> Iterator[Problem]:
    """A push of nothing, on what has no mass, or on somebody who walks."""
    key = "impulse" if push.force is None else "force"
    if not any(push.impulse or push.force):
        yield loaded.problem((*keys, "push", key), "SC055", "a push of zero changes nothing")
    things = loaded.world.spec.objects if loaded.world.spec else []
    spawned = [action.chosen for step in loaded.spec.steps for action in step.actions if action.kind == "spawn"]
    named: list[Any] = [thing for thing in (*things, *spawned) if getattr(thing, "name", "") == push.name]
    doors = [door.name for door in loaded.world.spec.doors] if loaded.world.spec else []
    if push.name in doors or (named and not any(thing.mass for thing in named)):
        message, hint = f"`{push.name}` has no mass: no push moves it", "give it a `mass`, or `move` it"
        yield loaded.problem((*keys, "push", "name"), "SC055", message, hint)
    elif push.name in pedestrian_names(loaded):
        message, hint = f"`{push.name}` is a person: no push moves them", "`stop`, `teleport` or `move` them"
        yield loaded.problem((*keys, "push", "name"), "SC055", message, hint)


def _idle_actions(loaded: LoadedScenario) -> Iterator[Problem]:
    """Pushes of nothing, and doors that are as they shall be."""
    done = [placed for step in loaded.spec.steps for placed in step.placed()]
    kinds = {(action.kind, getattr(action.chosen, "name", "")) for _, action in done}
    unknown = any(action.may() for _, action in done)
    shut = {door.name: door.closed for door in loaded.world.spec.doors} if loaded.world.spec else {}
    for keys, action in done:
        name = getattr(action.chosen, "name", "")
        if action.kind == "push":
            yield from _idle_push(loaded, keys, action.chosen)
        for kind, undone, so in (("open", "close", False), ("close", "open", True)):
            wide = getattr(action.chosen, "to", 1) == 1
            if action.kind == kind and wide and shut.get(name) is so and (undone, name) not in kinds and not unknown:
                state = "shut" if so else "open"
                message = f"door `{name}` is {state} from the start, and nothing {undone}s it"
                yield loaded.problem((*keys, kind, "name"), "SC055", message)
