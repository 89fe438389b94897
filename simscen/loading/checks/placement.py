"""Checks for poses of robots, goals, objects, and pedestrians inside an obstacle or outside the map."""

import math
from collections.abc import Iterator, Sequence
from itertools import combinations, product
from typing import TYPE_CHECKING

from simscen.core.errors import Problem
from simscen.core.geometry import Polygon, Pose2, Pose3
from simscen.core.geometry.motion_paths import MAX_STEP_M, largest_step, too_fast_message, top_speed
from simscen.core.geometry.polygons import transform_polygon
from simscen.core.geometry.shapes import MotionPath, Solid
from simscen.core.messages.goals import Goal
from simscen.loading.checks.registry import WORLD, CheckProblem
from simscen.loading.checks.scene import SILL_M, START, TOUCH_M, Scene, expected_failure_hint
from simscen.loading.goals import expects_start_failure
from simscen.loading.yaml.tree import Keys, MappingNode
from simscen.sim.body.outline import radius_and_height
from simscen.spec.motions import Motion
from simscen.worlds.extent import top_height
from simscen.worlds.geometry.overlaps import bounding_radius, first_solid_in_disc, polygons_overlap
from simscen.worlds.geometry.prisms import upright_prism

if TYPE_CHECKING:
    from simscen.actions.objects import Spawn
    from simscen.triggers.base import Trigger

FREE_SPACE_HINT = "move it to free space"
MAX_PLATFORM_HEIGHT_M = 0.3
"""Maximum height of an obstacle in a Gazebo world that could be the floor."""
TOLERANCE_FRACTIONS = (-0.9, 0.0, 0.9)
"""Offsets from the pose of a blocked goal that are tried, as fractions of its tolerances."""

MotionStop = tuple[Keys, str, tuple[float, float]]
"""Keyframe or waypoint of a motion: its keys in the motion, a description for messages, and (x, y) in m."""


def blocked_poses(scene: Scene) -> dict[Keys, CheckProblem]:
    """Return the problems of a blocked start, and of blocked goals and kidnap poses, by keys of the pose."""
    found: list[CheckProblem] = []
    if not expects_start_failure(scene.loaded.spec):
        solids = (*scene.world.solids, *scene.bodies)
        found += _pose_problem(scene, START, "the robot's start", scene.start, solids, FREE_SPACE_HINT)
    found += _blocked_goals(scene)
    for action in scene.loaded.actions:
        if action.kind == "kidnap":
            keys, description = (*action.keys, "pose"), "the pose to which the robot is kidnapped"
            found += _pose_problem(scene, keys, description, action.spec.pose.pose, scene.world.solids, FREE_SPACE_HINT)
    return {problem.keys: problem for problem in found}


@WORLD.check("SC301")
def blocked_robot_poses(scene: Scene) -> Iterator[CheckProblem]:
    """Find starts, goals, and kidnap poses inside an obstacle or outside the map."""
    yield from scene.cached(blocked_poses).values()


def _blocked_goals(scene: Scene) -> Iterator[CheckProblem]:
    """Yield an error for each goal that fixed solids block, and a warning for each goal inside an unmoved body.

    Unmoved bodies are those in `Scene.unmoved_bodies`.
    """
    for keys, goal in scene.expected_goals:
        code = "GOAL_OUTSIDE_MAP" if scene.outside_reason(goal.pose) else "GOAL_OCCUPIED"
        hint = f"move it, or {expected_failure_hint(keys, code)}"
        found = list(_pose_problem(scene, keys, f"goal `{goal.name}`", goal.pose, scene.world.solids, hint))
        if found and not _fits_nearby(scene, goal):
            yield from found
        position = goal.pose.x, goal.pose.y
        if not found and (body := first_solid_in_disc(scene.unmoved_bodies, position, TOUCH_M, scene.z_range)):
            message = f"goal `{goal.name}` is inside `{body}`, and no event moves or removes `{body}`"
            yield CheckProblem(keys, message, hint, is_warning=True)


def _fits_nearby(scene: Scene, goal: Goal) -> bool:
    """Return whether a pose within the tolerances of a blocked goal is free.

    Return False without a search for a round footprint, or if the inscribed circle of the footprint is not free at
    the goal.
    """
    is_outside = scene.outside_reason(goal.pose) is not None
    if is_outside or scene.size.radius is not None or scene.circle_conflict(goal.pose, scene.world.solids):
        return False
    x, y, yaw = goal.pose
    nearby_poses = (
        Pose2(x + a * goal.xy_tolerance, y + b * goal.xy_tolerance, yaw + c * goal.yaw_tolerance)
        for a, b, c in product(TOLERANCE_FRACTIONS, repeat=3)
        if math.hypot(a, b) <= 1
    )
    return any(scene.footprint_conflict(pose, scene.world.solids) is None for pose in nearby_poses)


def _pose_problem(
    scene: Scene, keys: Keys, description: str, pose: Pose2, solids: tuple[Solid, ...], hint: str
) -> Iterator[CheckProblem]:
    """Yield a problem if the robot at a pose overlaps `solids`, or is outside the map or the world.

    `description` describes the pose in the message.
    """
    conflict = scene.outside_reason(pose) or scene.footprint_conflict(pose, solids)
    if conflict:
        if scene.loaded.world.sdf is not None:
            hint = _hint_in_gazebo_world(scene, pose, solids, hint)
        yield CheckProblem(keys, f"{description} ({pose.x:g}, {pose.y:g}) is {conflict}", hint)


def _hint_in_gazebo_world(scene: Scene, pose: Pose2, solids: tuple[Solid, ...], hint: str) -> str:
    """Return `hint`, or a better hint for a pose outside the world or inside an obstacle that could be the floor."""
    if scene.outside_reason(pose):
        return f"{hint}; or drive with `map: none`"
    position = pose.x, pose.y
    solid = next((each for each in solids if first_solid_in_disc([each], position, TOUCH_M, scene.z_range)), None)
    if solid is None or (top := top_height(solid)) > MAX_PLATFORM_HEIGHT_M:
        return hint
    return f"robots start at z = 0, below its top: if it is the floor, lower all models by {top:g} m; otherwise {hint}"


@WORLD.check("SC304")
def blocked_spawns(scene: Scene) -> Iterator[CheckProblem]:
    """Find objects that would be spawned inside an obstacle or on the robot."""
    for action in scene.loaded.actions:
        if action.kind == "spawn":
            when = (
                action.step.when if action.step.after is None else None
            )  # later steps count from the step before them
            if where := _inside_obstacle(scene, action.spec) or _on_robot(scene, action.spec, when):
                message = f"`{action.spec.name}` would appear {where}"
                yield CheckProblem((*action.keys, "name"), message, "choose another pose")


def _inside_obstacle(scene: Scene, spawn: "Spawn") -> str | None:
    """Return "inside obstacle …" if an obstacle contains a spawned object completely; else None."""
    if spawn.pose is None:
        return None
    corners = transform_polygon(spawn.pose.pose, _outline(spawn))
    for solid in scene.world.solids:
        prism = upright_prism(solid)
        if prism is None or prism.bottom > spawn.z or prism.top < spawn.z + spawn.total_height:
            continue
        if all(prism.distance(corner, (prism.bottom, prism.top)) == 0 for corner in corners):
            return f'inside obstacle "{solid.name}"'
    return None


def _on_robot(scene: Scene, spawn: "Spawn", when: "Trigger | None") -> str | None:
    """Return "on the robot" if a spawned object overlaps the robot; None if it does not, or if the run decides."""
    if spawn.z >= scene.size.height:
        return None
    if spawn.ahead is not None:
        corners = transform_polygon(Pose2(spawn.ahead[0], spawn.ahead[1], spawn.yaw), _outline(spawn))
    elif spawn.pose is not None and when and when.time is not None and when.chosen.root + when.delay == 0:
        corners = transform_polygon(scene.start.inverse().compose(spawn.pose.pose), _outline(spawn))
    else:
        return None
    return "on the robot" if polygons_overlap(scene.size.footprint, corners) else None


def _outline(spawn: "Spawn") -> Polygon:
    """Return the outline of a spawned object on the floor, in the frame of the object."""
    solid = spawn.solid(spawn.name)
    prism = upright_prism(Solid(solid.shape, Pose3(z=solid.pose.z), spawn.name))
    return prism.base if prism is not None else tuple((x, y) for x, y in spawn.polygon or ())


@WORLD.check("SC304")
def blocked_pedestrians(scene: Scene) -> Iterator[CheckProblem]:
    """Find pedestrians with a start or goal that is closer to an obstacle than the radius of the pedestrian."""
    solids = (*scene.world.solids, *scene.immovable_bodies)
    for action in scene.loaded.actions:
        if action.kind != "pedestrian":
            continue
        spec = action.spec
        stops: list[MotionStop] = [(("pose",), f"the start of `{spec.name}`", (spec.pose.x, spec.pose.y))]
        stops += [(("goals", k), f"goal {k + 1} of `{spec.name}`", (x, y)) for k, (x, y) in enumerate(spec.goals)]
        for below, description, (x, y) in stops:
            if solid := first_solid_in_disc(solids, (x, y), spec.radius, (SILL_M, spec.height)):
                message = f'{description} ({x:g}, {y:g}) is closer to obstacle "{solid}" than {spec.radius:g} m'
                yield CheckProblem((*action.keys, *below), message, "choose a position with enough room")


@WORLD.check("SC304", severity="warning")
def motions_into_walls(scene: Scene) -> Iterator[CheckProblem]:
    """Find `move` actions with keyframes or waypoints, and `teleport` actions with poses, inside fixed obstacles."""
    for action in scene.loaded.actions:
        stops: list[MotionStop] = []
        if action.kind == "move":
            stops = motion_stops(action.spec)
        elif action.kind == "teleport":
            stops = [(("pose",), "the new pose", (action.spec.pose.x, action.spec.pose.y))]
        for below, description, (x, y) in stops:
            if solid := first_solid_in_disc(scene.world.solids, (x, y), TOUCH_M, scene.z_range):
                message = f'{description} of `{action.spec.name}` ({x:g}, {y:g}) is inside obstacle "{solid}"'
                hint = "move it to free space: walls do not stop scripted motions"
                yield CheckProblem((*action.keys, *below), message, hint)


@WORLD.check("SC305")
def too_fast_motions(scene: Scene) -> Iterator[CheckProblem]:
    """Find scripted motions that are so fast that contact with the robot could be missed between two ticks."""
    tick = 1 / scene.loaded.spec.physics.tick_rate
    for keys, tree, name, path, solids in _motions(scene):
        if top_speed(path, bounding_radius(solids)) * tick <= MAX_STEP_M:  # a fast test without NumPy
            continue
        step = largest_step(path, tick, radius_and_height(solids)[0] if solids else 0.0)
        if step > MAX_STEP_M:
            hint = f"make it {math.ceil(10 * step / MAX_STEP_M) / 10:g} times slower, or raise `physics.tick_rate`"
            yield CheckProblem(keys, too_fast_message(name, step), hint, tree=tree)


def _motions(scene: Scene) -> Iterator[tuple[Keys, MappingNode | None, str, MotionPath, Sequence[Solid]]]:
    """Yield (keys, YAML tree, body name, path, solids) of each motion that is known before the run.

    `keys` lead to the motion in the YAML tree; None is the tree of the scenario.
    """
    bodies = {body.name: body for body in scene.world.bodies}
    file = scene.loaded.world
    names = [world_object.name for world_object in file.spec.objects] if file.spec is not None else []
    for body in scene.world.bodies:
        if body.path is not None and body.name in names:
            yield ("objects", names.index(body.name), "move"), file.tree, body.name, body.path, body.solids
        elif body.path is not None:  # an actor of a Gazebo world
            yield ("world",), None, body.name, body.path, body.solids
    spawned = {action.spec.name: action.spec for action in scene.loaded.actions if action.kind == "spawn"}
    for action in scene.loaded.actions:
        name, keys = getattr(action.spec, "name", ""), (*action.keys, "name")
        if action.kind in ("open", "close") and name in scene.world.doors:
            from simscen.actions.doors import panel_path

            keys = (*action.keys, "duration") if "duration" in action.spec.model_fields_set else keys
            yield keys, None, name, panel_path(*scene.world.doors[name], action.spec.duration), bodies[name].solids
        elif action.kind == "move" and name in bodies:
            yield keys, None, name, action.spec.path(bodies[name].pose.plane), bodies[name].solids
        elif action.kind == "move" and (spawn := spawned.get(name)) is not None and spawn.pose is not None:
            yield keys, None, name, action.spec.path(spawn.pose.pose), (spawn.solid(name),)


def motion_stops(motion: Motion) -> list[MotionStop]:
    """Return the keyframes or waypoints of a motion."""
    if motion.keyframes is not None:
        return [(("keyframes", k), f"keyframe {k + 1}", (x, y)) for k, (_, x, y, _) in enumerate(motion.keyframes)]
    return [(("through", k), f"waypoint {k + 1}", (x, y)) for k, (x, y) in enumerate(motion.through or [])]


def overlapping_start_problems(scenes: Sequence[Scene]) -> Iterator[Problem]:
    """Yield a problem for each pair of robots with overlapping footprints at the start. Each robot has one scene."""
    for first, second in combinations(scenes, 2):
        outlines = [transform_polygon(scene.start, scene.size.footprint) for scene in (first, second)]
        if polygons_overlap(*outlines):
            names = f"robot `{second.loaded.robot_name}` overlaps robot `{first.loaded.robot_name}`"
            positions = f"({second.start.x:g}, {second.start.y:g}) and ({first.start.x:g}, {first.start.y:g})"
            message = f"{names} at the start: {positions}"
            yield second.loaded.problem(START, "SC044", message, "move one of them farther away")
