"""Where what a robot's files say of its geometry does not agree: all of it is warnings."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from simscen.core.errors import Problem
from simscen.loading.loaded import LoadedRobot
from simscen.loading.yaml.tree import value_position
from simscen.model.robot import RobotSpec
from simscen.run.worldsource import read_mesh
from simscen.sim.robot_body import RobotBody
from simscen.sim.undercarriage import Wheel

AGREE = 0.01
"""Share by which a dimension of the drive may differ from the URDF's."""


def geometry_notes(robot: LoadedRobot, spec: RobotSpec, body: RobotBody, roots: tuple[Path, ...]) -> list[Problem]:
    """Warnings about a robot with a URDF: other dimensions in its drive, wheels and casters off the ground."""
    if robot.urdf is None:
        return []
    from simscen.sim.urdf.body import tree_of_spec
    from simscen.sim.urdf.files import Found
    from simscen.sim.urdf.stance import stance_of

    tree = tree_of_spec(spec, robot.path, roots, read_mesh, Found(robot.urdf, robot.packages))
    return [*otherwise(robot, body), *stance_of(tree, spec.drive)]


def otherwise(robot: LoadedRobot, body: RobotBody) -> Iterator[Problem]:
    """Warnings about dimensions of the drive that are not those of the URDF."""
    if robot.tree is None or robot.urdf is None:
        return
    drawn = _drawn(body.wheels)
    for name in ("wheel_radius", "wheel_separation", "wheel_base"):
        said = getattr(body.drive, name, None)
        if said is None or name not in body.drive.model_fields_set or name not in drawn:
            continue
        if abs(said - drawn[name]) > AGREE * drawn[name]:
            message = f"{name} is {said:g} m here, but {drawn[name]:.4g} m in {robot.urdf.name}"
            hint = "the wheels stand where the URDF has them; commands and odometry reckon with what is written here"
            yield Problem(*value_position(robot.tree, ("drive", name)), "SC404", message, hint, "warning")


def _drawn(wheels: tuple[Wheel, ...]) -> dict[str, float]:
    """Dimensions as the wheels have them."""
    driven = [wheel for wheel in wheels if wheel.driven]
    if not driven:
        return {}
    left, right = ([wheel.y for wheel in driven if wheel.left is side] for side in (True, False))
    axles, steered = [wheel.x for wheel in driven], [wheel.x for wheel in wheels if wheel.steered]
    base = np.mean(steered) - np.mean(axles) if steered else max(axles) - min(axles)
    return {
        "wheel_radius": float(np.mean([wheel.radius for wheel in driven])),
        "wheel_separation": float(np.mean(left) - np.mean(right)),
        **({"wheel_base": float(base)} if base > 0 else {}),
    }
