"""Builds the world, the map, the filter masks, and the robot of a loaded scenario from their files."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from simscen.core.environment.costmap_filters import FilterMasks, MaskBlocks, mask_blocks
from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.environment.world_model import World
from simscen.core.errors import InvalidInput, Problem
from simscen.core.geometry import Pose2
from simscen.core.geometry.shapes import Mesh
from simscen.loading.goals import event_goals, expects_failure, scenario_goals
from simscen.loading.loaded import (
    KEEPOUT_MASK_KEYS,
    SPEED_MASK_KEYS,
    CriterionMask,
    LoadedMap,
    LoadedRobot,
    LoadedScenario,
    LoadedWorld,
)
from simscen.loading.schema.messages import quoted, suggestion
from simscen.loading.yaml.textfile import with_source_line
from simscen.loading.yaml.tree import Keys, MappingNode, key_position, value_position
from simscen.model.robot import RobotSpec
from simscen.model.world import Door, WorldObject, WorldSpec
from simscen.worlds.world_file import world_from_spec

if TYPE_CHECKING:
    from simscen.sim.body.robot_body import RobotBody

Bounds = tuple[float, float, float, float]
"""(min x, min y, max x, max y) in m."""


def load_world(loaded: LoadedScenario) -> World:
    """Build the world of a scenario. Raises InvalidInput for an unusable map image or SDF file."""
    try:
        return world_from_file(loaded.world, loaded.root, loaded.world_path, loaded.lenient)
    except InvalidInput as error:
        raise InvalidInput([p if p.source else loaded.with_source_line(p) for p in error.problems]) from error


def with_stops_in_bounds(world: World, loaded: LoadedScenario) -> World:
    """Return the world with bounds that contain the stops of all robots.

    Stops are start poses, goals without an expected failure, and poses to which events kidnap a robot. A world without
    open ground, or with a map, is returned unchanged.
    """
    if not world.has_open_ground or world.grid is not None or loaded.map is not None:
        return world
    stops = [stop for view in loaded.robot_views.values() for stop in _stops(view)]
    first = stops[0][:2]
    bounds = extend_bounds(world.bounds if any(world.bounds) else (*first, *first), stops)
    return world if bounds == world.bounds else replace(world, bounds=bounds)


def _stops(loaded: LoadedScenario) -> Iterator[Pose2]:
    """Yield the stops of the robot of a view (see `with_stops_in_bounds`)."""
    spec = loaded.spec
    yield spec.only_robot.pose.pose
    for goal in (*scenario_goals(spec), *event_goals(loaded).values()):
        if not expects_failure(spec, goal.name):
            yield goal.pose
    yield from (action.spec.pose.pose for action in loaded.actions if action.kind == "kidnap")


def extend_bounds(bounds: Bounds, poses: list[Pose2]) -> Bounds:
    """Return the smallest bounds that contain `bounds` and the poses."""
    left, bottom, right, top = bounds
    xs, ys = [pose.x for pose in poses], [pose.y for pose in poses]
    return min([left, *xs]), min([bottom, *ys]), max([right, *xs]), max([top, *ys])


def world_from_file(source: LoadedWorld, root: Path, world_path: Sequence[Path] = (), lenient: bool = False) -> World:
    """Build the world from its loaded files. Raises InvalidInput for an unusable map image or SDF file.

    Files that an SDF file refers to must lie in `root` or in a folder of `world_path`. With `lenient`, unsupported
    elements of an SDF file become warnings in the `notes` of the world.
    """
    base, grid, notes = None, None, tuple[str, ...]()
    if source.sdf is not None:
        from simscen.worlds.sdf import load_sdf

        base = load_sdf(source.sdf, search=world_path, root=root, lenient=lenient)
        _check_names(source, base)
    if source.map is not None:
        from simscen.worlds.maps import ros_map

        grid, notes = ros_map.load_map(source.map.spec, source.map.image)
    return world_from_spec(source.spec or WorldSpec(simscen=1), source.name, grid, base, notes)


def _check_names(source: LoadedWorld, sdf: World) -> None:
    """Raise InvalidInput if something in a world file has the name of a body of its SDF file."""
    if source.spec is None or source.tree is None:
        return
    taken = {body.name for body in sdf.bodies}
    lists: dict[str, Sequence[WorldObject | Door]] = {
        "obstacles": source.spec.obstacles,
        "objects": source.spec.objects,
        "doors": source.spec.doors,
    }
    problems = [
        Problem(
            *value_position(source.tree, (key, index, "name")),
            "SC033",
            f"a model of the SDF file is also called {quoted(entry.name)}",
            "choose another name",
        )
        for key, entries in lists.items()
        for index, entry in enumerate(entries)
        if entry.name in taken
    ]
    if problems:
        raise InvalidInput(problems)


def load_map(source: LoadedMap) -> OccupancyGrid:
    """Load the occupancy grid of a ROS map. Raises InvalidInput for an unusable image."""
    from simscen.worlds.maps import ros_map

    return ros_map.load_map(source.spec, source.image)[0]


def read_mesh(path: Path) -> Mesh:
    """Read a mesh file of a URDF. Raises ValueError for an unusable file."""
    from simscen.worlds.sdf.meshes import read_mesh as read

    try:
        return read(path)
    except InvalidInput as error:
        raise ValueError("; ".join(problem.message for problem in error.problems)) from error


def load_robot(loaded: LoadedScenario) -> tuple[RobotSpec, RobotBody]:
    """Return the specification and the body of the robot of a scenario, with its payload and motor torque.

    The specification of a robot without a robot file is inferred from its URDF. Raises InvalidInput for unusable files,
    and for a payload with which the robot falls over.
    """
    try:
        spec, body = robot_from_file(loaded.robot, (loaded.root, *loaded.world_path))
        return spec, _with_payload_and_torque(loaded, body)
    except InvalidInput as error:
        raise InvalidInput([p if p.source else loaded.with_source_line(p) for p in error.problems]) from error


def _with_payload_and_torque(loaded: LoadedScenario, body: RobotBody) -> RobotBody:
    """Return the body with payload and motor torque of the scenario. Raises InvalidInput if the robot falls over."""
    entry = loaded.spec.only_robot
    if entry.payload is None and entry.motor_torque == 1.0:
        return body
    from simscen.sim.body.robot_body import add_payload, center_of_mass, hull_height, is_stable, scale_motor_torque

    body = scale_motor_torque(body, entry.motor_torque)
    if entry.payload is not None:
        x, y, z = entry.payload.at or (0.0, 0.0, hull_height(body))
        body = add_payload(body, entry.payload.mass, (x, y, z))
        if not is_stable(body):
            x, y, _ = center_of_mass(body)
            position = f"with its payload, its center of mass is at ({x:.2f}, {y:.2f}), outside its wheels"
            message, hint = f"the robot falls over: {position}", "put the payload nearer to the middle"
            raise InvalidInput([loaded.problem(("robot", "payload"), "SC406", message, hint)])
    return body


def robot_from_file(robot: LoadedRobot, roots: tuple[Path, ...]) -> tuple[RobotSpec, RobotBody]:
    """Return the specification and the body of a robot, whose files must lie in `roots`. Raises InvalidInput."""
    from simscen.sim.body.from_spec import build_robot_body
    from simscen.sim.urdf.xacro.expand import UnknownArgument
    from simscen.sim.urdf.xml_source import RobotFiles

    spec = robot.spec
    if spec is None:
        from simscen.sim.urdf.inference import infer_robot_spec

        spec = infer_robot_spec(robot.path, roots, read_mesh)
    files = RobotFiles(robot.urdf, robot.packages) if robot.urdf else None
    try:
        return spec, build_robot_body(spec, robot.path, roots, read_mesh, files)
    except UnknownArgument as error:
        assert robot.tree is not None and robot.urdf is not None  # only robot files with xacro have arguments
        message = f"{quoted(robot.urdf.name)} declares no argument {quoted(error.name)}"
        hint = suggestion(error.name, error.declared) or "it has no <xacro:arg>"
        position = key_position(robot.tree, ("arguments", error.name))
        raise InvalidInput([Problem(*position, "SC403", message, hint)]) from error


MAX_RECTANGLES = 100_000
"""Maximum number of rectangles of equal cells in the mask of a criterion. Every log contains all rectangles."""


def load_masks(loaded: LoadedScenario) -> FilterMasks:
    """Load the costmap filter masks of the stack. Raises InvalidInput at the line of an unusable mask."""
    keepout, limits, speed_mask = None, None, loaded.spec.stack.speed_mask
    if loaded.keepout_mask is not None:
        keepout = _mask_grid(loaded.keepout_mask, KEEPOUT_MASK_KEYS, loaded.tree, loaded.sources)
    if loaded.speed_mask is not None and speed_mask is not None:
        limits = speed_mask.speed_limits(_mask_grid(loaded.speed_mask, SPEED_MASK_KEYS, loaded.tree, loaded.sources))
    return FilterMasks(keepout, limits)


def load_criterion_masks(
    masks: Mapping[str, CriterionMask], tree: MappingNode, texts: Mapping[str, str]
) -> dict[str, MaskBlocks]:
    """Load the masks of criteria, divided into rectangles of equal cells, by path as written in the scenario.

    `tree` and `texts` belong to the scenario. Raises InvalidInput at the line of an unusable or too complex mask.
    """
    found = {}
    for name, mask in masks.items():
        found[name] = mask_blocks(_mask_grid(mask.map, mask.keys, tree, texts))
        count = len(found[name].blocks)
        if count > MAX_RECTANGLES:
            message = f"mask image {mask.map.image.name} consists of {count} rectangles of equal cells"
            hint = f"a criterion supports up to {MAX_RECTANGLES}; use a mask image without noise"
            problem = Problem(*value_position(tree, mask.keys), "SC320", message, hint)
            raise InvalidInput([with_source_line(problem, texts)])
    return found


def _mask_grid(source: LoadedMap, keys: Keys, tree: MappingNode, texts: Mapping[str, str]) -> OccupancyGrid:
    """Return the grid of the mask at `keys` of the scenario. Raises InvalidInput with the position of `keys`."""
    try:
        return load_map(source)
    except InvalidInput as error:
        position = value_position(tree, keys)._asdict()
        moved = [
            replace(problem, **position, message=f"mask image {source.image.name}: {problem.message}")
            for problem in error.problems
        ]
        raise InvalidInput([with_source_line(problem, texts) for problem in moved]) from error
