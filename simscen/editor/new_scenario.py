"""Text of a new scenario in a given world: a robot, a reachable goal, and two criteria."""

import os
from pathlib import Path

import numpy as np
import numpy.typing as npt

from simscen.core.environment.occupancy_grid import FREE
from simscen.core.environment.world_model import BuiltWorld
from simscen.core.geometry import Array, Pose2
from simscen.editor.text_editing.value_text import scalar_text
from simscen.loading.builders import world_from_file
from simscen.loading.files.single_files import load_world_file

LIDAR_HEIGHT_M = 0.2
"""Height of the horizontal section of the world that becomes the map."""
PREFERRED_CLEARANCE_M = 0.5
"""Minimum distance of start and goal from walls. If no position has this distance, smaller distances are tried."""
MAX_CANDIDATES = 200
"""Maximum number of free positions from which start and goal are chosen."""


def new_scenario_text(file: Path, world_file: Path, root: Path, world_path: tuple[Path, ...], lenient: bool) -> str:
    """Return the text of a new scenario `file` in the world of `world_file`.

    `world_file` is a world file, a ROS map, or an SDF file. It may refer to files in the folders `root` and
    `world_path`. With `lenient`, unsupported SDF elements are left out. Raises InvalidInput if `world_file` is invalid.
    """
    from simscen.worlds.built_world import build_world_and_map

    source = load_world_file(world_file, root, world_path)
    built = build_world_and_map(world_from_file(source, root, world_path, lenient), LIDAR_HEIGHT_M)
    start, goal = (f"{{x: {pose.x:.2f}, y: {pose.y:.2f}, yaw: 0 deg}}" for pose in _start_and_goal(built))
    name = scalar_text(file.name.split(".")[0].replace("_", " "))
    world = scalar_text(Path(os.path.relpath(world_file.resolve(), file.resolve().parent)).as_posix())
    if source.spec is None:  # a map or an SDF file needs an inline world
        world = f"\n  simscen: 1\n  {'sdf' if source.sdf is not None else 'map'}: {world}"
    else:
        world = f" {world}"
    return f"""\
simscen: 1
name: {name}
description: What this scenario tests, and why.
world:{world}
robot:
  pose: {start}
goals:
  - {{name: goal, pose: {goal}}}
pass:
  - goals_reached: {{}}
  - collisions: {{max: 0}}
"""


def _start_and_goal(built: BuiltWorld) -> tuple[Pose2, Pose2]:
    """Return a free start, and the farthest free goal with a path from the start.

    If there is no such goal, the goal is the start. Without free space, start and goal are the origin.
    """
    points = _free_points(built)
    if not len(points):
        return Pose2(0.0, 0.0), Pose2(0.0, 0.0)
    start = points[0]
    from simscen.worlds.routes.shortest_paths import shortest_paths_in

    poses = [Pose2(round(x, 2), round(y, 2)) for x, y in points.tolist()]
    paths = shortest_paths_in(built, poses, PREFERRED_CLEARANCE_M / 2)
    order = np.argsort(-np.linalg.norm(points - start, axis=1))
    reachable = (poses[k] for k in order.tolist() if paths.path(poses[0], poses[k]) is not None)
    return poses[0], next(reachable, poses[0])


def _free_points(built: BuiltWorld) -> Array:
    """Return at most MAX_CANDIDATES free positions (n, 2) in m, if possible PREFERRED_CLEARANCE_M from walls."""
    from scipy import ndimage

    grid = built.map
    free = np.pad(grid.cells == FREE, 1)
    clearance = ndimage.distance_transform_edt(free)[1:-1, 1:-1] * grid.resolution
    for min_clearance in (PREFERRED_CLEARANCE_M, PREFERRED_CLEARANCE_M / 2, 0.0):
        cells = _cells_in_bounds(np.argwhere(clearance > min_clearance), built)
        if len(cells):
            chosen = cells[np.linspace(0, len(cells) - 1, min(MAX_CANDIDATES, len(cells))).astype(np.int64)]
            return np.round(grid.center_of(chosen), 2)
    return np.zeros((0, 2))


def _cells_in_bounds(cells: npt.NDArray[np.int64], built: BuiltWorld) -> npt.NDArray[np.int64]:
    """Return the cells (n, 2) inside the bounds of the world; all cells if the world has a map."""
    if built.world.grid is not None:
        return cells
    left, low, right, high = built.world.bounds
    x, y = built.map.center_of(cells).T
    is_inside: npt.NDArray[np.bool_] = (x > left) & (x < right) & (y > low) & (y < high)
    cells_inside: npt.NDArray[np.int64] = cells[is_inside]
    return cells_inside
