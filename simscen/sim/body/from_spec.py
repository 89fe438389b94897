"""Builds the body of a robot from its specification: from simple shapes, or from a URDF."""

from collections.abc import Sequence
from pathlib import Path

from simscen.core.geometry import Pose3
from simscen.core.geometry.shapes import Solid
from simscen.model.robot import RobotSpec
from simscen.sim.body.inertia import MassProperties, inertia_of_solids
from simscen.sim.body.robot_body import RobotBody, assemble_body, check_ground_clearance, check_robot_size
from simscen.sim.body.undercarriage import wheels_for_drive
from simscen.sim.urdf.body import body_from_tree, read_spec_tree
from simscen.sim.urdf.elements import MeshReader
from simscen.sim.urdf.xml_source import RobotFiles

CENTER_OF_MASS_HEIGHT_RATIO = 0.5
"""Height of the center of mass divided by the height of the hull's centroid."""


def build_robot_body(
    spec: RobotSpec,
    file: Path | None = None,
    roots: Sequence[Path] = (),
    read_mesh: MeshReader | None = None,
    robot_files: RobotFiles | None = None,
) -> RobotBody:
    """Build the body of a robot from its specification. Raises InvalidInput if the URDF or the body is unusable.

    `file` is the `*.robot.yaml`. The URDF is at the path in `robot_files`, or by default at `spec.urdf` relative to
    `file`. All files must be in `roots` (default: the folder of `file`). Without `read_mesh`, a URDF must not have
    meshes.
    """
    if spec.urdf is None:
        body = _body_from_shapes(spec, file)
    else:
        body = body_from_tree(spec, read_spec_tree(spec, file, roots, read_mesh, robot_files))
    check_robot_size(body, file)
    return body


def _body_from_shapes(spec: RobotSpec, file: Path | None) -> RobotBody:
    assert spec.body is not None and spec.mass is not None  # ensured by RobotSpec
    check_ground_clearance(spec, file)
    parts = tuple(
        Solid(solid.shape, Pose3.planar(part.pose.pose).compose(solid.pose), solid.name)
        for part in spec.body
        for solid in [part.solid("hull")]
    )
    wheels = wheels_for_drive(spec.drive, spec.mass)
    uniform = inertia_of_solids(parts, spec.mass - sum(w.inertia.mass for w in wheels))
    chassis = MassProperties(uniform.mass, uniform.center * (1.0, 1.0, CENTER_OF_MASS_HEIGHT_RATIO), uniform.tensor)
    return assemble_body(spec, parts, wheels, chassis)
