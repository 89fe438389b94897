"""Names to which a scenario can refer: places, regions, objects, goals, events, faults, and verdicts."""

from collections.abc import Mapping

from simscen.core.environment.world_model import World
from simscen.core.messages.goals import loop_goal_name
from simscen.criteria.registry import verdict_names
from simscen.loading.loaded import LoadedScenario
from simscen.model.world import WorldSpec

KIND_NAMES = {
    "place": "place of the world",
    "region": "region of the world",
    "door": "door of the world",
    "object": "object of the world or of an event",
    "movable": "movable object of the world or of an event",
    "mover": "movable object of the world or of an event",
    "goal": "goal",
    "event": "event or mark",
    "disturbance": "event, fault or mark",
    "verdict": "criterion, event or fault",
}
"""Descriptions for messages, by kind of reference (see `ReferenceTo`)."""

Names = Mapping[str, list[str] | None]
"""Valid names by kind of reference (see `ReferenceTo`); None for a kind if its names are not known.

The names in a world from SDF or a map are not known before the world is built. The names of verdicts are not known in
the view of one of several robots.
"""


def known_names(loaded: LoadedScenario, world: World | None = None) -> Names:
    """Return all names to which a scenario can refer. `world` is its built world; None if it is not built yet."""
    world_names = _names_in_files(loaded) if world is None else _names_in_built_world(loaded, world)
    movable = world_names["movable"]
    marks = _names_in_actions(loaded, "mark")
    disturbances = _distinct(event_names(loaded), [fault.label for fault in loaded.spec.faults])
    return {
        **world_names,
        "mover": None if movable is None else [*movable, *loaded.other_robots],
        "goal": goal_names(loaded),
        "event": _distinct(event_names(loaded), marks),
        "disturbance": _distinct(disturbances, marks),
        "verdict": None if loaded.other_robots else _distinct(verdict_names(loaded.spec.pass_), disturbances),
    }


def goal_names(loaded: LoadedScenario) -> list[str]:
    """Return the names of the goals under `goals`, then of the goals that events send."""
    return listed_goal_names(loaded) + _names_in_actions(loaded, "new_goal")


def listed_goal_names(loaded: LoadedScenario) -> list[str]:
    """Return the names of the goals under `goals`, repeated for each loop of the navigation."""
    loops = range(1, loaded.spec.navigation.loops + 1)
    return [loop_goal_name(name, loop) for loop in loops for name in loaded.spec.goal_names]


def event_names(loaded: LoadedScenario) -> list[str]:
    """Return the names of the events, each followed by the names of the steps of its sequence."""
    return [step.name for step in loaded.spec.steps]


def _names_in_files(loaded: LoadedScenario) -> Names:
    """Return the names of places, regions, doors, and objects, as far as they are known without a built world."""
    world = loaded.world.spec
    is_imported = loaded.world.map is not None or loaded.world.sdf is not None
    spawned = spawned_names(loaded)
    names: dict[str, list[str] | None] = {
        "place": list(world.places) if world else [],
        "region": list(world.regions) if world else [],
        "door": [door.name for door in world.doors] if world else [],
        "object": None,
        "movable": None,
    }
    if world is not None and not is_imported:
        names["object"] = _distinct(_object_names(world), spawned, list(loaded.other_robots))
        names["movable"] = _distinct(_movable_names(world), spawned)
    return names


def _names_in_built_world(loaded: LoadedScenario, world: World) -> Names:
    body_names, spawned = [body.name for body in world.bodies], spawned_names(loaded)
    return {
        "place": list(world.places),
        "region": list(world.regions),
        "door": list(world.doors),
        "object": _distinct(body_names, [solid.name for solid in world.solids], spawned, list(loaded.other_robots)),
        "movable": _distinct(body_names, spawned),
    }


def world_object_names(loaded: LoadedScenario, world: World | None) -> list[str]:
    """Return the names of all objects of the world; without the built `world`, only of objects in the world file."""
    if world is not None:
        return [*(body.name for body in world.bodies), *(solid.name for solid in world.solids)]
    return _object_names(loaded.world.spec) if loaded.world.spec is not None else []


def spawned_names(loaded: LoadedScenario) -> list[str]:
    """Return the names of the objects and pedestrians that events add to the world."""
    return _names_in_actions(loaded, "spawn") + pedestrian_names(loaded)


def pedestrian_names(loaded: LoadedScenario) -> list[str]:
    """Return the names of the pedestrians that events add to the world, alone or in crowds."""
    crowds = [action.spec.names for action in loaded.all_actions if action.kind == "crowd"]
    return _names_in_actions(loaded, "pedestrian") + [name for crowd in crowds for name in crowd]


def _names_in_actions(loaded: LoadedScenario, kind: str) -> list[str]:
    """Return the names in all actions of one kind, such as "spawn". New goals of other robots are left out."""
    actions = loaded.actions if kind == "new_goal" else loaded.all_actions
    return [str(action.spec.name) for action in actions if action.kind == kind]


def _movable_names(world: WorldSpec) -> list[str]:
    return [*(movable.name for movable in world.objects), *(door.name for door in world.doors)]


def _object_names(world: WorldSpec) -> list[str]:
    """Return the names of all solid objects of a world file, including walls, ramps, and doors."""
    return [
        *_movable_names(world),
        *(obstacle.name for obstacle in world.obstacles),
        *(ramp.name for ramp in world.ramps),
        *(wall.label(number) for number, wall in enumerate(world.walls, start=1)),
    ]


def _distinct(*names: list[str]) -> list[str]:
    return list(dict.fromkeys(name for part in names for name in part))
