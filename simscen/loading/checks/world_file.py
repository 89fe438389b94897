"""What in a world file means nothing: names that two things share, things without extent, the same thing twice."""

from collections.abc import Iterator
from dataclasses import replace

from simscen.core.problems import Problem
from simscen.loading.loaded import LoadedWorld
from simscen.loading.schema.messages import quoted, suggestion
from simscen.loading.yaml.tree import Key, MappingNode, key_position, value_position
from simscen.model.world import Thing, WorldSpec

Keys = tuple[Key, ...]


def check_world_file(world: LoadedWorld) -> list[Problem]:
    """Problems at their places in the world's file, without the text of their lines; some are warnings."""
    if world.spec is None or world.tree is None:
        return []
    return [
        problem
        for check in (_shared_names, _no_extent, _twice, _frictions)
        for problem in check(world.spec, world.tree)
    ]


def _shared_names(spec: WorldSpec, tree: MappingNode) -> Iterator[Problem]:
    """A thing that can move needs a name of its own; fixed ones that share theirs cannot be told apart in reports."""
    moving = {thing.name for thing in spec.objects} | {door.name for door in spec.doors}
    seen: set[str] = set()
    for index, obstacle in enumerate(spec.obstacles):
        place = value_position(tree, ("obstacles", index, "name"))
        if obstacle.name in moving:
            message = f"an object or a door is called {quoted(obstacle.name)}, too"
            yield Problem(*place, code="SC033", message=message, hint="give one of them another name")
        elif obstacle.name in seen:
            message = f"another obstacle is called {quoted(obstacle.name)}, too: reports cannot tell them apart"
            yield Problem(*place, code="SC033", message=message, severity="warning")
        seen.add(obstacle.name)
    for number, wall in enumerate(spec.walls, start=1):
        if wall.called(number) in moving:
            place = value_position(tree, ("walls", number - 1, "name"))
            message = f"an object or a door is called {quoted(wall.called(number))}, too"
            yield Problem(*place, code="SC033", message=message, hint="give one of them another name")


def _no_extent(spec: WorldSpec, tree: MappingNode) -> Iterator[Problem]:
    for index, wall in enumerate(spec.walls):
        if all(point == wall.points[0] for point in wall.points):
            yield _at(tree, ("walls", index, "points"), "SC313", "the wall has no length")
    for index, ramp in enumerate(spec.ramps):
        if ramp.start == ramp.end:
            yield _at(tree, ("ramps", index, "end"), "SC313", "the ramp has no length: it ends where it starts")
    for index, door in enumerate(spec.doors):
        if door.points[0] == door.points[1]:
            yield _at(tree, ("doors", index, "points"), "SC313", "the door has no width")
    for index, thing in enumerate(spec.objects):
        if thing.move is None:
            continue
        if len(set(thing.move.path(thing.pose.pose).poses)) == 1:
            key = "through" if thing.move.keyframes is None else "keyframes"
            problem = _at(tree, ("objects", index, "move", key), "SC313", "it moves nowhere")
            yield replace(problem, severity="warning")


def _twice(spec: WorldSpec, tree: MappingNode) -> Iterator[Problem]:
    """The same shape at the same place under another name."""
    things: list[tuple[Keys, Thing]] = [(("obstacles", k), thing) for k, thing in enumerate(spec.obstacles)]
    things += [(("objects", k), thing) for k, thing in enumerate(spec.objects)]
    seen: list[tuple[object, str]] = []
    for keys, thing in things:
        shape = (thing.box, thing.cylinder, thing.polygon, thing.height, thing.z, thing.pose.pose)
        same = next((name for other, name in seen if other == shape), None)
        if same is not None:
            problem = Problem(
                *key_position(tree, keys), code="SC054", message=f"{quoted(same)} is exactly there already"
            )
            yield replace(problem, severity="warning")
        seen.append((shape, thing.name))


def _frictions(spec: WorldSpec, tree: MappingNode) -> Iterator[Problem]:
    """The floor is slippery in regions, which are those of the same file."""
    for name in spec.friction:
        if name not in spec.regions:
            place = key_position(tree, ("friction", name))
            message, hint = f"no region is called {quoted(name)}", suggestion(name, spec.regions)
            yield Problem(*place, code="SC030", message=message, hint=hint)


def _at(tree: MappingNode, keys: Keys, code: str, message: str) -> Problem:
    return Problem(*value_position(tree, keys), code=code, message=message)
