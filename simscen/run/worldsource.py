"""Where a scenario's world, map and robot come from."""

from collections.abc import Sequence
from pathlib import Path

from simscen.core.errors import InvalidInput
from simscen.core.grid import OccupancyGrid
from simscen.core.problems import Problem
from simscen.core.shapes import Mesh
from simscen.core.world import World
from simscen.loading.loaded import LoadedMap, LoadedScenario, LoadedWorld
from simscen.model.robot import RobotSpec
from simscen.model.world import WorldSpec
from simscen.sim.robot_body import RobotBody, robot_body
from simscen.worlds.own import build_own


def load_world(loaded: LoadedScenario) -> World:
    """The world of a scenario. Raises InvalidInput for a map image or an SDF file that cannot be used."""
    return world_of(loaded.world, loaded.root, loaded.world_path, loaded.lenient)


def world_of(source: LoadedWorld, root: Path, world_path: Sequence[Path] = (), lenient: bool = False) -> World:
    """The world of a file; what SDF names stays inside `root` and `world_path`.

    Raises InvalidInput for a map image or an SDF file that cannot be used; with `lenient`, the elements of SDF that
    cannot be used become notes.
    """
    base: World | None = None
    if source.sdf is not None:
        from simscen.worlds.sdf import load_sdf

        base = load_sdf(source.sdf, search=world_path, root=root, lenient=lenient)
    spec = source.spec or WorldSpec(simscen=1)
    grid, notes = _map_and_notes(source.map) if source.map else (None, ())
    return build_own(spec, source.name, grid, base, notes)


def load_map(source: LoadedMap) -> OccupancyGrid:
    """The grid of a ROS map."""
    return _map_and_notes(source)[0]


def _map_and_notes(source: LoadedMap) -> tuple[OccupancyGrid, tuple[str, ...]]:
    from simscen.worlds.rosmap import load_grid

    return load_grid(source.spec, source.image)


def _read_mesh(path: Path) -> Mesh:
    """For a URDF, which tells what is wrong with a mesh at the line that names it."""
    from simscen.worlds.sdf.meshes import read_mesh

    try:
        return read_mesh(path)
    except InvalidInput as error:
        raise ValueError("; ".join(problem.message for problem in error.problems)) from error


def load_robot(loaded: LoadedScenario) -> tuple[RobotSpec, RobotBody]:
    """The robot as specified, and made ready for physics."""
    robot = loaded.robot
    if robot.spec is None:
        hint = (
            "write a short *.robot.yaml beside it that names its drive, limits and sensors: see `simscen explain robot`"
        )
        problem = Problem(str(robot.path), 0, 0, "SC201", "a URDF alone does not say how the robot drives", hint)
        raise InvalidInput([problem])
    return robot.spec, robot_body(robot.spec, robot.path, (loaded.root, *loaded.world_path), _read_mesh)
