"""Functions that read the objects on the map from the data of a scenario: robots, goals, events, zones, faults.

The data are dicts, lists, and scalars, and can be invalid. `keys` are the path to a value in the file.
"""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from simscen.criteria.registry import AnyCriterion
from simscen.editor.map_view.map_objects import (
    Keys,
    MapObject,
    Places,
    circle,
    items,
    mapping,
    motion_path,
    number,
    outline,
    point_handle,
    point_handles,
    pose_handle,
)
from simscen.model.disturbances import FaultEntry
from simscen.spec.choice import Choice

PERSON_RADIUS_M = 0.25
"""Radius of a pedestrian without the key `radius`."""
KIND_OF_POSE_ACTION = {"teleport": "teleport", "kidnap": "kidnap", "new_goal": "goal"}
"""Kind of the object on the map for each action with a pose."""
COMBINED_TRIGGERS = {"all", "any"}
"""Triggers that contain a list of triggers."""


def scenario_objects(data: dict[str, Any], places: Places) -> Iterator[MapObject]:
    """Yield the objects of a scenario, except the objects of its world."""
    yield MapObject((), "settings", str(data.get("name", "scenario")))
    robots = mapping(data.get("robots"))
    if not robots:
        yield from _robot(mapping(data.get("robot")), ("robot",), "robot", places)
        yield from _goals(data.get("goals"), ("goals",), "", places)
    for name, robot in robots.items():
        robot_keys: Keys = ("robots", name)
        yield from _robot(mapping(robot), robot_keys, f"robot {name}", places)
        yield from _goals(mapping(robot).get("goals"), (*robot_keys, "goals"), f"{name}: ", places)
        yield from _zones(mapping(robot), robot_keys, f"{name}: ")
        yield from _faults(mapping(robot), robot_keys, places)
    for index, event in enumerate(map(mapping, items(data.get("events")))):
        event_keys: Keys = ("events", index)
        label = str(event.get("name", f"event-{index + 1}"))
        yield MapObject(event_keys, "event", label)
        yield from _event(event, event_keys, label, places)
        for step_index, step in enumerate(map(mapping, items(event.get("then")))):
            step_label = str(step.get("name", f"{label} then {step_index + 1}"))
            yield from _event(step, (*event_keys, "then", step_index), step_label, places)
    yield from _zones(data, (), "")
    yield from _faults(data, (), places)
    for index, criterion in enumerate(map(mapping, items(data.get("pass")))):
        kind = _kind(criterion, AnyCriterion)
        condition = mapping(criterion.get(kind))
        region = condition.get("region", condition.get("in"))
        yield MapObject(("pass", index), "criterion", kind, region=region if isinstance(region, str) else "")


def _robot(robot: dict[str, Any], keys: Keys, label: str, places: Places) -> Iterator[MapObject]:
    """Yield a robot, and its initial pose estimate if the scenario sets it."""
    yield MapObject(keys, "robot", label, pose_handle(robot.get("pose"), (*keys, "pose"), places))
    estimate_keys = (*keys, "initial_estimate")
    if estimate := pose_handle(robot.get("initial_estimate"), estimate_keys, places):
        yield MapObject(estimate_keys, "estimate", f"initial estimate of {label}", estimate)


def _goals(value: Any, keys: Keys, prefix: str, places: Places) -> Iterator[MapObject]:
    """Yield an object for each goal in a list. `prefix` is the beginning of the label."""
    for index, goal in enumerate(items(value)):
        goal_keys = (*keys, index)
        pose = goal if isinstance(goal, str) else mapping(goal).get("pose")
        default = pose if isinstance(pose, str) else f"goal-{index + 1}"
        name = str(mapping(goal).get("name", default))
        label = prefix + (name if name.startswith("goal") else f"goal {name}")
        radius = number(mapping(goal).get("xy_tolerance"))
        radius_keys = (*goal_keys, "xy_tolerance") if radius is not None else ()
        handle = pose_handle(pose, (*goal_keys, "pose"), places)
        yield MapObject(goal_keys, "goal", label, handle, radius=radius, radius_keys=radius_keys)


def _event(event: dict[str, Any], keys: Keys, label: str, places: Places) -> Iterator[MapObject]:
    """Yield the objects for the triggers and actions of an event."""
    yield from _triggers(event.get("when"), (*keys, "when"), f"trigger of {label}", places)
    actions, do_keys = event.get("do"), (*keys, "do")
    listed = [((*do_keys, index), action) for index, action in enumerate(items(actions))]
    for action_keys, action in [(do_keys, actions)] if isinstance(actions, dict) else listed:
        for kind, value in mapping(action).items():
            yield from _action(kind, mapping(value), (*action_keys, kind), label, places)


def _action(kind: str, action: dict[str, Any], keys: Keys, event: str, places: Places) -> Iterator[MapObject]:
    """Yield the objects for an action of the event `event`; nothing for the key `robot`, which is not an action."""
    handle = pose_handle(action.get("pose"), (*keys, "pose"), places)
    name = str(action.get("name", ""))
    if kind == "spawn":
        yield MapObject(keys, "spawn", name or kind, handle, outline(action))
    elif kind == "pedestrian":
        goals_keys = (*keys, "goals")
        goals = point_handles(action.get("goals"), goals_keys, places)
        body = [circle(number(action.get("radius")) or PERSON_RADIUS_M)]
        yield MapObject(keys, "person", name or kind, (*handle, *goals), body, "open", points_keys=goals_keys)
    elif kind in KIND_OF_POSE_ACTION:
        label = f"goal {name}" if kind == "new_goal" else f"{kind} {name}".strip()
        yield MapObject(keys, KIND_OF_POSE_ACTION[kind], f"{label} of {event}", handle)
    elif kind == "move":
        paths = list(motion_path(action, keys, f"path of {name}", places))
        yield from paths or [MapObject(keys, "action", f"move {name}")]
    elif kind != "robot":
        yield replace(_area_action(action, keys, places), label=f"{kind} {name}".strip())


def _area_action(action: dict[str, Any], keys: Keys, places: Places) -> MapObject:
    """Return an object without label for an action in a region or a circle."""
    region = action.get("region", action.get("start"))
    region_name = region if isinstance(region, str) else ""
    center = point_handle(action.get("at"), (*keys, "at"), places)
    radius = number(action.get("radius")) if center else None
    radius_keys = (*keys, "radius") if radius is not None else ()
    return MapObject(keys, "action", "", center, radius=radius, radius_keys=radius_keys, region=region_name)


def _triggers(value: Any, keys: Keys, label: str, places: Places) -> Iterator[MapObject]:
    """Yield objects for the regions and circles of a trigger, including nested triggers."""
    for kind, condition in mapping(value).items():
        trigger_keys, arguments = (*keys, kind), mapping(condition)
        if kind in COMBINED_TRIGGERS:
            for index, part in enumerate(items(condition)):
                yield from _triggers(part, (*trigger_keys, index), label, places)
        elif kind == "not":
            yield from _triggers(condition, trigger_keys, f"{label} (not)", places)
        elif kind == "robot_in":
            yield MapObject(trigger_keys, "trigger", label, region=str(arguments.get("region", "")))
        elif kind == "robot_within":
            center = point_handle(arguments.get("of"), (*trigger_keys, "of"), places)
            yield MapObject(
                trigger_keys,
                "trigger",
                label,
                center,
                radius=number(arguments.get("distance")),
                radius_keys=(*trigger_keys, "distance"),
                region=str(arguments.get("region", "")),
                center_object=str(arguments.get("object", "")),
            )


def _zones(data: dict[str, Any], keys: Keys, prefix: str) -> Iterator[MapObject]:
    """Yield the keepout and speed zones of the stack in the data of a scenario or robot."""
    stack = mapping(data.get("stack"))
    for index, region in enumerate(items(stack.get("keepout"))):
        zone_keys = (*keys, "stack", "keepout", index)
        yield MapObject(zone_keys, "keepout", f"{prefix}keepout zone {region}", region=str(region))
    for index, zone in enumerate(map(mapping, items(stack.get("speed_zones")))):
        zone_keys, region = (*keys, "stack", "speed_zones", index), str(zone.get("region", ""))
        yield MapObject(zone_keys, "speed zone", f"{prefix}speed zone {region}", region=region)


def _faults(data: dict[str, Any], keys: Keys, places: Places) -> Iterator[MapObject]:
    """Yield the faults of a scenario or robot, and the objects for their triggers."""
    for index, fault in enumerate(map(mapping, items(data.get("faults")))):
        fault_keys = (*keys, "faults", index)
        label = str(fault.get("name", f"{fault.get('sensor', 'fault')} {_kind(fault, FaultEntry)}"))
        yield MapObject(fault_keys, "fault", label)
        yield from _triggers(fault.get("when"), (*fault_keys, "when"), f"trigger of {label}", places)


def _kind(entry: dict[str, Any], model: type[Choice]) -> str:
    """Return the kind of a criterion or fault: the first key that is not a modifier of `model`."""
    modifiers = model.known_keys() - model.choices().keys() | {"robot"}
    return next((key for key in entry if key not in modifiers), "entry")
