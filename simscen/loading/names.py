"""What a scenario can refer to by name."""

from collections.abc import Mapping

from simscen.loading.loaded import LoadedScenario
from simscen.model.world import WorldSpec

ARTICLES = {
    "place": "place of the world",
    "region": "region of the world",
    "door": "door of the world",
    "object": "object of the world or of an event",
    "goal": "goal",
    "event": "event",
    "happening": "event or fault",
}


def known_names(loaded: LoadedScenario) -> Mapping[str, list[str] | None]:
    """For each kind of reference the names there are, in the order of the files; None = only its importer knows."""
    world, events = loaded.world.spec, event_names(loaded)
    return {
        "place": list(world.places) if world else [],
        "region": list(world.regions) if world else [],
        "door": [door.name for door in world.doors] if world else [],
        "object": _objects(loaded),
        "goal": goal_names(loaded),
        "event": events,
        "happening": events + [fault.label for fault in loaded.spec.faults],
    }


def goal_names(loaded: LoadedScenario) -> list[str]:
    """The goals of the scenario, then those that its events send."""
    own = [
        goal.name or (goal.pose if isinstance(goal.pose, str) else f"goal-{number}")
        for number, goal in enumerate(loaded.spec.goals, start=1)
    ]
    sent = _made(loaded, "new_goal")
    return own + sent


def event_names(loaded: LoadedScenario) -> list[str]:
    """Names as written, or event-1, event-2, …"""
    return [event.name or f"event-{number}" for number, event in enumerate(loaded.spec.events, start=1)]


def _objects(loaded: LoadedScenario) -> list[str] | None:
    world = loaded.world
    if world.spec is None or world.map is not None or world.sdf is not None:
        return None
    return _standing(world.spec) + _made(loaded, "spawn")


def _made(loaded: LoadedScenario, kind: str) -> list[str]:
    """The names that actions of one kind give to what they bring."""
    actions = [action for event in loaded.spec.events for action in event.actions]
    return [str(getattr(action.chosen, "name", "")) for action in actions if action.kind == kind]


def _standing(world: WorldSpec) -> list[str]:
    things = [
        *(thing.name for thing in world.objects),
        *(door.name for door in world.doors),
        *(obstacle.name for obstacle in world.obstacles),
        *(wall.name for wall in world.walls),
    ]
    return list(dict.fromkeys(things))
