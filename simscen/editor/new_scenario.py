"""Text of a new scenario in a world or on a map: a robot, a goal that it can reach, and criteria."""

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
from simscen.loading.loaded import LoadedWorld

LIDAR_HEIGHT_M = 0.2
ROOM_M = 0.5
"""Distance from walls that start and goal have where there is room."""
CANDIDATES = 200


def new_scenario_text(file: Path, world_file: Path, root: Path, world_path: tuple[Path, ...], lenient: bool) -> str:
    """Return the text of a scenario `file` in a world that `simscen world` reads. Raises InvalidInput."""
    from simscen.worlds.built_world import build_world_and_map

    source = load_world_file(world_file, root, world_path)
    built = build_world_and_map(world_from_file(source, root, world_path, lenient), LIDAR_HEIGHT_M)
    start, goal = _start_and_goal(built)
    name = file.name.split(".")[0].replace("_", " ")
    written = scalar_text(Path(os.path.relpath(world_file.resolve(), file.resolve().parent)).as_posix())
    return "\n".join(
        [
            "simscen: 1",
            f"name: {scalar_text(name)}",
            "description: What this scenario tests, and why.",
            *_world_lines(source, written),
            "robot:",
            f"  pose: {_pose_text(start)}",
            "goals:",
            f"  - {{name: goal, pose: {_pose_text(goal)}}}",
            "pass:",
            "  - goals_reached: {}",
            "  - collisions: {max: 0}",
            "",
        ]
    )


def _world_lines(source: LoadedWorld, written: str) -> list[str]:
    """Return the key `world`: the world file, or an inline world on a map or SDF file, to which things can be added."""
    if source.spec is not None:
        return [f"world: {written}"]
    return ["world:", "  simscen: 1", f"  {'sdf' if source.sdf is not None else 'map'}: {written}"]


def _pose_text(pose: Pose2) -> str:
    return f"{{x: {pose.x:.2f}, y: {pose.y:.2f}, yaw: 0 deg}}"


def _start_and_goal(built: BuiltWorld) -> tuple[Pose2, Pose2]:
    """Return two free positions that are far apart and connected; the origin twice if there is no free space."""
    points = _roomy_points(built)
    if not len(points):
        return Pose2(0.0, 0.0), Pose2(0.0, 0.0)
    start = points[0]
    from simscen.worlds.routes.shortest_paths import shortest_paths_in

    poses = [Pose2(round(x, 2), round(y, 2)) for x, y in points.tolist()]
    ways = shortest_paths_in(built, poses, ROOM_M / 2)
    order = np.argsort(-np.linalg.norm(points - start, axis=1))
    reachable = (poses[k] for k in order.tolist() if ways.path(poses[0], poses[k]) is not None)
    return poses[0], next(reachable, poses[0])


def _roomy_points(built: BuiltWorld) -> Array:
    """Return positions (n, 2) far from walls; the first one is nearest to a corner of the map."""
    from scipy import ndimage

    grid = built.map
    free = np.pad(grid.cells == FREE, 1)
    room = ndimage.distance_transform_edt(free)[1:-1, 1:-1] * grid.resolution
    for needed in (ROOM_M, ROOM_M / 2, 0.0):
        cells = _in_bounds(np.argwhere(room > needed), built)
        if len(cells):
            chosen = cells[np.linspace(0, len(cells) - 1, min(CANDIDATES, len(cells))).astype(np.int64)]
            return np.round(grid.center_of(chosen), 2)
    return np.zeros((0, 2))


def _in_bounds(cells: npt.NDArray[np.int64], built: BuiltWorld) -> npt.NDArray[np.int64]:
    """Return the cells inside the bounds of a world without a map of its own, which limit where goals may be."""
    if built.world.grid is not None:
        return cells
    left, low, right, high = built.world.bounds
    x, y = built.map.center_of(cells).T
    inside: npt.NDArray[np.bool_] = (x > left) & (x < right) & (y > low) & (y < high)
    chosen: npt.NDArray[np.int64] = cells[inside]
    return chosen
