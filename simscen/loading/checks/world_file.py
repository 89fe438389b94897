"""Checks for world files with duplicate names, duplicate shapes, objects of zero size, or unknown regions."""

from collections.abc import Iterator

from simscen.loading.checks.registry import WORLD_FILE, CheckProblem
from simscen.loading.schema.messages import quoted, suggestion
from simscen.loading.yaml.tree import Keys
from simscen.model.world import WorldObject, WorldSpec


@WORLD_FILE.check("SC033")
def duplicate_names_in_world(spec: WorldSpec) -> Iterator[CheckProblem]:
    """Find obstacles and walls with the name of an object or door, and obstacles with the same name (a warning)."""
    movable_names = {movable.name for movable in spec.objects} | {door.name for door in spec.doors}
    seen: set[str] = set()
    for index, obstacle in enumerate(spec.obstacles):
        keys: Keys = ("obstacles", index, "name")
        if obstacle.name in movable_names:
            message = f"an object or a door is also called {quoted(obstacle.name)}"
            yield CheckProblem(keys, message, "rename one of them")
        elif obstacle.name in seen:
            message = f"another obstacle is also called {quoted(obstacle.name)}; reports cannot distinguish them"
            yield CheckProblem(keys, message, is_warning=True)
        seen.add(obstacle.name)
    for number, wall in enumerate(spec.walls, start=1):
        if wall.label(number) in movable_names:
            message = f"an object or a door is also called {quoted(wall.label(number))}"
            yield CheckProblem(("walls", number - 1, "name"), message, "rename one of them")


@WORLD_FILE.check("SC313")
def zero_extents(spec: WorldSpec) -> Iterator[CheckProblem]:
    """Find walls, ramps, and doors of zero length, and motions that stay at one pose (a warning)."""
    for index, wall in enumerate(spec.walls):
        if all(point == wall.points[0] for point in wall.points):
            yield CheckProblem(("walls", index, "points"), "the wall has no length: all its points are the same")
    for index, ramp in enumerate(spec.ramps):
        if ramp.start == ramp.end:
            yield CheckProblem(("ramps", index, "end"), "the ramp has no length: `start` and `end` are the same")
    for index, door in enumerate(spec.doors):
        if door.points[0] == door.points[1]:
            yield CheckProblem(("doors", index, "points"), "the door has no width: both points are the same")
    for index, movable in enumerate(spec.objects):
        if movable.move is not None and len(set(movable.move.path(movable.pose.pose).poses)) == 1:
            key = "through" if movable.move.keyframes is None else "keyframes"
            yield CheckProblem(("objects", index, "move", key), "the motion leads nowhere", is_warning=True)


@WORLD_FILE.check("SC054", severity="warning")
def duplicate_shapes(spec: WorldSpec) -> Iterator[CheckProblem]:
    """Find obstacles and objects with the same shape and pose as another obstacle or object."""
    objects: list[tuple[Keys, WorldObject]] = [
        (("obstacles", k), obstacle) for k, obstacle in enumerate(spec.obstacles)
    ]
    objects += [(("objects", k), movable) for k, movable in enumerate(spec.objects)]
    seen: list[tuple[object, str]] = []
    for keys, obj in objects:
        shape_and_pose = (obj.box, obj.cylinder, obj.polygon, obj.height, obj.z, obj.pose.pose)
        same = next((name for other, name in seen if other == shape_and_pose), None)
        if same is not None:
            yield CheckProblem(keys, f"{quoted(same)} has the same shape and pose", at_key=True)
        seen.append((shape_and_pose, obj.name))


@WORLD_FILE.check("SC030")
def unknown_friction_regions(spec: WorldSpec) -> Iterator[CheckProblem]:
    """Find entries of `friction` for regions that do not exist."""
    for name in spec.friction:
        if name not in spec.regions:
            message, hint = f"no region is called {quoted(name)}", suggestion(name, spec.regions)
            yield CheckProblem(("friction", name), message, hint, at_key=True)
