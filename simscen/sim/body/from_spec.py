"""The body of a robot from its specification: of simple shapes, or from a URDF."""

from collections.abc import Sequence
from pathlib import Path

from simscen.core.geometry import Pose3
from simscen.core.geometry.shapes import Solid
from simscen.model.robot import RobotSpec
from simscen.sim.body.inertia import MassProperties, inertia_of_solids
from simscen.sim.body.robot_body import RobotBody, assemble, check_ground_clearance, check_robot_size
from simscen.sim.body.undercarriage import wheels_for_drive
from simscen.sim.urdf.body import body_from_urdf
from simscen.sim.urdf.elements import MeshReader
from simscen.sim.urdf.xml_source import RobotFiles

CENTER_OF_MASS_HEIGHT_RATIO = 0.5
"""Height of the center of mass over that of the hull's volume: batteries and motors lie at the bottom."""


def build_robot_body(
    spec: RobotSpec,
    file: Path | None = None,
    roots: Sequence[Path] = (),
    read_mesh: MeshReader | None = None,
    found: RobotFiles | None = None,
) -> RobotBody:
    """Build the body of a robot from its specification.

    `file` is the `*.robot.yaml`, to which `spec.urdf` is relative unless it was `found` already; `roots` are the
    folders that the URDF and its meshes must lie in; `read_mesh` reads a mesh file. Raises InvalidInput when the URDF
    or the body cannot be used.
    """
    body = _of_shapes(spec, file) if spec.urdf is None else body_from_urdf(spec, file, roots, read_mesh, found)
    check_robot_size(body, file)
    return body


def _of_shapes(spec: RobotSpec, file: Path | None) -> RobotBody:
    assert spec.body is not None and spec.mass is not None  # RobotSpec promises it
    check_ground_clearance(spec, file)
    parts = tuple(
        Solid(solid.shape, Pose3.planar(part.pose.pose).compose(solid.pose), solid.name)
        for part in spec.body
        for solid in [part.solid("hull")]
    )
    wheels = wheels_for_drive(spec.drive, spec.mass)
    even = inertia_of_solids(parts, spec.mass - sum(w.inertia.mass for w in wheels))
    chassis = MassProperties(even.mass, even.center * (1.0, 1.0, CENTER_OF_MASS_HEIGHT_RATIO), even.tensor)
    return assemble(spec, parts, wheels, chassis)
