"""Checks for names that do not exist, are not unique, or are not allowed in their place."""

from collections.abc import Container, Iterator
from dataclasses import replace
from typing import TYPE_CHECKING

from simscen.core.messages.goals import LOOP_GOAL_PATTERN
from simscen.criteria.registry import verdict_names
from simscen.loading.checks.registry import NAMES, ROBOT_NAMES, CheckProblem, NameScope
from simscen.loading.known_names import KIND_NAMES, event_names, known_names, listed_goal_names, world_object_names
from simscen.loading.multirobot import ROBOTS
from simscen.loading.schema.messages import quoted, suggestion
from simscen.loading.spec_walk import Reference, references, walk
from simscen.loading.yaml.tree import Keys
from simscen.model.scenario import ScenarioSpec
from simscen.spec.choice import Choice

if TYPE_CHECKING:
    from simscen.triggers.base import AnyCondition

RENAME_HINT = "rename one of them"


@NAMES.check("SC030")
def unknown_names(scope: NameScope) -> Iterator[CheckProblem]:
    """Find names that refer to nothing."""
    for reference, names, is_immovable in _unknown_references(scope):
        if not is_immovable:
            hint = suggestion(reference.name, dict.fromkeys(names)) or "there is none"
            message = f"no {KIND_NAMES[reference.target]} is called {quoted(reference.name)}"
            yield CheckProblem(reference.keys, message, hint)


@NAMES.check("SC035")
def names_of_immovable_objects(scope: NameScope) -> Iterator[CheckProblem]:
    """Find names of fixed objects or robots where the name of a movable object is expected."""
    for reference, _, is_immovable in _unknown_references(scope):
        if is_immovable:
            is_robot = reference.name in _forbidden_robots(scope, reference)
            kind = "one of the robots" if is_robot else "a fixed part of the world"
            message = f"{quoted(reference.name)} is {kind}, which cannot be moved or followed"
            yield CheckProblem(reference.keys, message, "name an object, a door or something that an event spawns")


def _unknown_references(scope: NameScope) -> Iterator[tuple[Reference, list[str], bool]]:
    """Yield (reference, valid names, is_immovable) for each reference with an invalid name.

    `is_immovable`: whether a movable object is expected, but the name is that of a fixed object or a forbidden robot.
    """
    loaded, known = scope.loaded, known_names(scope.loaded, scope.world)
    for reference in references(loaded.spec, includes_robot=loaded.includes_robot):
        names = known.get(reference.target)
        if names is not None and reference.name not in names:
            immovable_names = (*_forbidden_robots(scope, reference), *(known["object"] or ()))
            yield reference, names, reference.target in ("movable", "mover") and reference.name in immovable_names


def _forbidden_robots(scope: NameScope, reference: Reference) -> tuple[str, ...]:
    """Return the names of the robots that a reference to a movable object must not name."""
    this_robot = (scope.loaded.robot_name,) if reference.target == "movable" else ()
    return (*this_robot, *scope.loaded.other_robots)


@NAMES.check("SC031")
def unknown_lidars(scope: NameScope) -> Iterator[CheckProblem]:
    """Find `scan_age` triggers for a lidar that the robot does not have."""
    loaded = scope.loaded
    if loaded.robot.spec is None:
        return
    lidars = [name for name, sensor in loaded.robot.spec.sensors.items() if sensor.reading_type == "Scan"]
    for keys, part in walk(loaded.spec, includes_robot=loaded.includes_robot):
        sensor = getattr(getattr(part, "scan_age", None), "sensor", None)
        if sensor is not None and sensor not in lidars:
            message = f"robot `{loaded.robot.name}` has no lidar called {quoted(sensor)}"
            yield CheckProblem((*keys, "scan_age", "sensor"), message, suggestion(sensor, lidars) or "it has no lidar")


@NAMES.check("SC033")
def duplicate_names(scope: NameScope) -> Iterator[CheckProblem]:
    """Find goals, events, or faults with the same name, and events with the name of a fault."""
    loaded = scope.loaded
    lists: dict[str, list[tuple[Keys, str | None]]] = {
        "goal": [(("goals", k), goal.name) for k, goal in enumerate(loaded.spec.goals)],
        "event": [(step.keys, step.entry.name) for step in loaded.spec.steps],
        "fault": [(("faults", k), fault.name) for k, fault in enumerate(loaded.spec.faults)],
    }
    for kind, names in lists.items():
        seen: dict[str, Keys] = {}
        for keys, name in names:
            if name is not None and name in seen:
                first = loaded.position_of(*seen[name], "name")
                message = f"{kind} {quoted(name)} is already defined at {first.line}:{first.col}"
                yield CheckProblem((*keys, "name"), message, "choose another name")
            seen.setdefault(name or "", keys)
    for index, fault in enumerate(loaded.spec.faults):
        if fault.label in event_names(loaded):
            message = f"an event is also called {quoted(fault.label)}; criteria cannot distinguish them"
            yield CheckProblem(("faults", index, "sensor" if fault.name is None else "name"), message, RENAME_HINT)


@NAMES.check("SC033")
def duplicate_marks_and_new_goals(scope: NameScope) -> Iterator[CheckProblem]:
    """Find marks with the name of an event or fault, and `new_goal` actions with the name of another goal."""
    loaded = scope.loaded
    disturbances = [*event_names(loaded), *(fault.label for fault in loaded.spec.faults)]
    goals = listed_goal_names(loaded)
    for action in loaded.all_actions:
        if action.kind == "mark" and action.spec.name in disturbances:
            message = f"an event or a fault is also called {quoted(action.spec.name)}; criteria cannot distinguish them"
            yield CheckProblem((*action.keys, "name"), message, RENAME_HINT)
        if action.kind == "new_goal" and loaded.includes_robot(action.choice.robot):
            if action.spec.name in goals:
                message = f"another goal is also called {quoted(action.spec.name)}; criteria cannot distinguish them"
                yield CheckProblem((*action.keys, "name"), message, "choose another name")
            goals.append(action.spec.name)


@NAMES.check("SC033")
def reserved_goal_names(scope: NameScope) -> Iterator[CheckProblem]:
    """Find goals with names such as `shelf#2`, which are reserved for goals in the second and later loops."""
    for index, goal in enumerate(scope.loaded.spec.goals):
        if goal.name is not None and LOOP_GOAL_PATTERN.fullmatch(goal.name):
            message = f"{quoted(goal.name)} is reserved for the goals of the second and later loops"
            yield CheckProblem(("goals", index, "name"), message, "choose a name that does not end in # and a number")


@NAMES.check("SC033")
def duplicate_pedestrians(scope: NameScope) -> Iterator[CheckProblem]:
    """Find pedestrians that have the same name as an object or another pedestrian."""
    loaded = scope.loaded
    used_names = dict.fromkeys(world_object_names(loaded, scope.world), "an object of the world")
    for action in loaded.all_actions:
        if action.kind not in ("spawn", "pedestrian", "crowd"):
            continue
        names = action.spec.names if action.kind == "crowd" else [action.spec.name]
        repeated = [name for name in names if name in used_names]
        if repeated and (action.kind != "spawn" or used_names[repeated[0]] == "a pedestrian"):
            message = f"{used_names[repeated[0]]} is also called {quoted(repeated[0])}"
            yield CheckProblem((*action.keys, "name"), message, RENAME_HINT)
        used_names.update(dict.fromkeys(names, "a spawned object" if action.kind == "spawn" else "a pedestrian"))


@NAMES.check("SC033")
def robots_named_like_objects(scope: NameScope) -> Iterator[CheckProblem]:
    """Find robots with the name of an object of the world."""
    loaded = scope.loaded
    objects = known_names(replace(loaded, other_robots=()), scope.world)["object"] or ()
    if loaded.robot_name in objects:
        message = f"an object of the world is also called {quoted(loaded.robot_name)}"
        yield CheckProblem(("robot",), message, "rename the robot", at_key=True)


@ROBOT_NAMES.check("SC030")
def unknown_robots(spec: ScenarioSpec) -> Iterator[CheckProblem]:
    """Find triggers and actions that name a robot that does not exist."""
    robots = spec.robots or {}
    for keys, part in walk({"events": spec.events, "faults": spec.faults, ROBOTS: robots}):
        robot = getattr(part, "robot", None) if isinstance(part, Choice) else None
        if robot is None or robot in robots:
            continue
        message, hint = f"no robot is called {quoted(robot)}", suggestion(robot, robots)
        if not robots:
            message, hint = f"{message}: the only robot has no name", "remove `robot`"
        yield CheckProblem((*keys, "robot"), message, hint)


@ROBOT_NAMES.check("SC043")
def missing_robot_names(spec: ScenarioSpec) -> Iterator[CheckProblem]:
    """In a scenario of several robots, find triggers and actions that apply to one robot, but do not name the robot."""
    if not spec.robots:
        return
    events = {step.name for step in spec.steps}
    faults = {fault.label for robot in spec.robots.values() for fault in robot.faults} - events
    hint = f"add {' or '.join(f'`robot: {name}`' for name in sorted(spec.robots))}"
    for step in spec.steps:
        unnamed = [] if step.when is None else list(_conditions_without_robot(step.when, (*step.keys, "when"), faults))
        unnamed += [
            action.keys for action in step.actions if action.choice.robot is None and action.spec.is_robot_specific
        ]
        for keys in unnamed:
            yield CheckProblem(keys, f"`{keys[-1]}` must name one of the robots", hint, at_key=True)


def _conditions_without_robot(condition: "AnyCondition", keys: Keys, faults: Container[str]) -> Iterator[Keys]:
    """Yield the keys of each condition on the state of a robot, or on one of `faults`, that names no robot."""
    if condition.robot is not None:
        return
    for key, inner in (("all", condition.all), ("any", condition.any)):
        for number, part in enumerate(inner or ()):
            yield from _conditions_without_robot(part, (*keys, key, number), faults)
    if condition.not_ is not None:
        yield from _conditions_without_robot(condition.not_, (*keys, "not"), faults)
    if condition.operands:
        return
    if condition.chosen.is_robot_specific or (condition.kind == "event" and condition.chosen.name in faults):
        yield *keys, condition.kind


@ROBOT_NAMES.check("SC030")
def unknown_expected_verdicts(spec: ScenarioSpec) -> Iterator[CheckProblem]:
    """In a scenario of several robots, find names under `expected.criteria` that belong to no verdict."""
    if not spec.robots:
        return
    known = [step.name for step in spec.steps]
    for name, robot in sorted(spec.robots.items()):
        verdicts = [*verdict_names([*spec.pass_, *robot.pass_]), *(fault.label for fault in robot.faults)]
        known += [f"{name}/{verdict}" for verdict in verdicts]
    for number, expected in enumerate(spec.expected.criteria if spec.expected else ()):
        if expected not in known:
            matches = [verdict for verdict in known if verdict.partition("/")[2] == expected]
            hint = f"write {' or '.join(f'`{match}`' for match in matches)}" if matches else suggestion(expected, known)
            message = f"no criterion, event or fault is called {quoted(expected)}"
            yield CheckProblem(("expected", "criteria", number), message, hint)
