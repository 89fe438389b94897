"""Checks of a robot's geometry: dimensions that contradict the URDF, and parts at a wrong height."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from simscen.core.errors import InvalidInput, Problem
from simscen.loading.builders import read_mesh, robot_from_file
from simscen.loading.files.single_files import RobotFile
from simscen.loading.loaded import LoadedRobot
from simscen.loading.yaml.tree import value_position
from simscen.model.robot import RobotSpec
from simscen.sim.body.robot_body import RobotBody, check_ground_clearance
from simscen.sim.body.undercarriage import Wheel

DIMENSION_TOLERANCE = 0.01
"""Largest relative difference between a dimension of the drive in the robot file and in the URDF."""


def geometry_warnings(robot: LoadedRobot, spec: RobotSpec, body: RobotBody, roots: tuple[Path, ...]) -> list[Problem]:
    """Return warnings about a URDF: dimensions unlike those in the robot file, or wheels and casters off the ground.

    `spec` and `body` are the results of `robot_from_file`, and `roots` is its argument.
    """
    if robot.urdf is None:
        return []
    from simscen.sim.urdf.alignment import alignment_warnings
    from simscen.sim.urdf.body import read_spec_tree
    from simscen.sim.urdf.xml_source import RobotFiles

    tree = read_spec_tree(spec, robot.path, roots, read_mesh, RobotFiles(robot.urdf, robot.packages))
    return [*dimension_warnings(robot, body), *alignment_warnings(tree, spec.drive)]


def dimension_warnings(robot: LoadedRobot, body: RobotBody) -> Iterator[Problem]:
    """Yield a warning for each dimension of the drive in the robot file that differs from the URDF."""
    if robot.tree is None or robot.urdf is None:
        return
    urdf_dimensions = _urdf_dimensions(body.wheels)
    for name in ("wheel_radius", "wheel_separation", "wheel_base"):
        written = getattr(body.drive, name, None)
        if written is None or name not in body.drive.model_fields_set or name not in urdf_dimensions:
            continue
        if abs(written - urdf_dimensions[name]) > DIMENSION_TOLERANCE * urdf_dimensions[name]:
            message = f"{name} is {written:g} m here, but {urdf_dimensions[name]:.4g} m in {robot.urdf.name}"
            hint = "the wheels are placed as in the URDF, but commands and odometry use the value written here"
            yield Problem(*value_position(robot.tree, ("drive", name)), "SC404", message, hint, "warning")


def _urdf_dimensions(wheels: tuple[Wheel, ...]) -> dict[str, float]:
    """Return the dimensions of the drive in m, computed from its wheels, by key under `drive` of a robot file."""
    driven = [wheel for wheel in wheels if wheel.is_driven]
    if not driven:
        return {}
    left, right = ([wheel.y for wheel in driven if wheel.is_left is side] for side in (True, False))
    axles, steered = [wheel.x for wheel in driven], [wheel.x for wheel in wheels if wheel.is_steered]
    base = np.mean(steered) - np.mean(axles) if steered else max(axles) - min(axles)
    return {
        "wheel_radius": float(np.mean([wheel.radius for wheel in driven])),
        "wheel_separation": float(np.mean(left) - np.mean(right)),
        **({"wheel_base": float(base)} if base > 0 else {}),
    }


def robot_problems(file: RobotFile) -> list[Problem]:
    """Return errors and warnings about the geometry of a robot. It is only built if it has a URDF."""
    robot = file.robot
    try:
        if robot.urdf is not None:
            spec, body = robot_from_file(robot, file.roots)
            found = geometry_warnings(robot, spec, body, file.roots)
        else:
            assert robot.spec is not None  # a robot has one or the other
            check_ground_clearance(robot.spec, robot.path)
            found = []
    except InvalidInput as error:
        found = error.problems
    return file.library.with_source(found)
