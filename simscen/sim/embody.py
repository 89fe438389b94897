"""The body of a robot from its specification: of simple shapes, or from a URDF."""

from collections.abc import Sequence
from pathlib import Path

from simscen.core.geometry import Pose3
from simscen.core.geometry.shapes import Solid
from simscen.model.robot import RobotSpec
from simscen.sim.ground import refuse_dragging
from simscen.sim.inertia import MassProperties, of_solids
from simscen.sim.robot_body import RobotBody, assemble
from simscen.sim.size import refuse_giants
from simscen.sim.undercarriage import wheels_of
from simscen.sim.urdf.body import body_of_urdf
from simscen.sim.urdf.elements import MeshReader
from simscen.sim.urdf.files import Found

LOW = 0.5
"""Height of the center of mass over that of the hull's volume: batteries and motors lie at the bottom."""


def robot_body(
    spec: RobotSpec,
    file: Path | None = None,
    roots: Sequence[Path] = (),
    read_mesh: MeshReader | None = None,
    found: Found | None = None,
) -> RobotBody:
    """The body of a robot as specified.

    `file` is the `*.robot.yaml`, to which `spec.urdf` is relative unless it was `found` already; `roots` are the
    folders that the URDF and its meshes must lie in; `read_mesh` reads a mesh file. Raises InvalidInput when the URDF
    or the body cannot be used.
    """
    body = _of_shapes(spec, file) if spec.urdf is None else body_of_urdf(spec, file, roots, read_mesh, found)
    refuse_giants(body, file)
    return body


def _of_shapes(spec: RobotSpec, file: Path | None) -> RobotBody:
    assert spec.body is not None and spec.mass is not None  # RobotSpec promises it
    refuse_dragging(spec, file)
    parts = tuple(
        Solid(solid.shape, Pose3.planar(part.pose.pose).compose(solid.pose), solid.name)
        for part in spec.body
        for solid in [part.solid("hull")]
    )
    wheels = wheels_of(spec.drive, spec.mass)
    even = of_solids(parts, spec.mass - sum(w.inertia.mass for w in wheels))
    chassis = MassProperties(even.mass, even.center * (1.0, 1.0, LOW), even.tensor)
    return assemble(spec, parts, wheels, chassis)
