"""A robot made ready for physics: one rigid hull, wheels where its drive needs them. Needs no engine."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from simscen.core.geometry import Pose3
from simscen.core.shapes import Mesh, Solid
from simscen.core.world import Polygon
from simscen.model.robot import Drive, Limits, RobotSpec
from simscen.sim.ground import refuse_dragging
from simscen.sim.inertia import MassProperties, of_solids
from simscen.sim.outline import circle, footprint
from simscen.sim.undercarriage import Wheel, guards, motorised, on_casters, wheels_of

LOW = 0.5
"""Height of the centre of mass over that of the hull's volume: batteries and motors lie at the bottom."""
MeshReader = Callable[[Path], Mesh]


@dataclass(frozen=True, eq=False)
class RobotBody:
    """Everything needed to build a robot, in its base frame: on the ground under the middle of its axle.

    `hull` and `casters` touch obstacles; `casters` also glide on the ground without friction; wheels only roll on it.
    `chassis` is the mass of all but the wheels. `footprint` is anticlockwise; `radius` is set for a round robot.
    """

    name: str
    hull: tuple[Solid, ...]
    casters: tuple[Solid, ...]
    wheels: tuple[Wheel, ...]
    chassis: MassProperties
    footprint: Polygon
    radius: float | None
    drive: Drive
    limits: Limits

    @property
    def urdf(self) -> str:
        """The robot as URDF, for viewers."""
        from simscen.sim.urdf.describe import describe

        return describe(self)

    @property
    def mass(self) -> float:
        """Of the whole robot in kg."""
        return self.chassis.mass + sum(wheel.inertia.mass for wheel in self.wheels)

    @property
    def solid(self) -> tuple[Solid, ...]:
        """What can touch an obstacle, in the order in which the engine gets it."""
        return (*self.casters, *self.hull)

    @property
    def circumscribed_radius(self) -> float:
        """The smallest circle around the base's origin that holds the footprint, in metres."""
        return max(math.hypot(x, y) for x, y in self.footprint)


def robot_body(
    spec: RobotSpec, file: Path | None = None, roots: Sequence[Path] = (), read_mesh: MeshReader | None = None
) -> RobotBody:
    """The body of a robot as specified.

    `file` is the `*.robot.yaml`, to which `spec.urdf` is relative; `roots` are the folders that the URDF and its
    meshes must lie in; `read_mesh` reads a mesh file. Raises InvalidInput when the URDF or the body cannot be
    used.
    """
    if spec.urdf is not None:
        from simscen.sim.urdf.body import body_of_urdf

        return body_of_urdf(spec, file, roots, read_mesh)
    return _of_shapes(spec, file)


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
    chassis = MassProperties(even.mass, even.centre * (1.0, 1.0, LOW), even.tensor)
    return assemble(spec, parts, wheels, chassis)


def assemble(
    spec: RobotSpec, parts: tuple[Solid, ...], wheels: tuple[Wheel, ...], chassis: MassProperties
) -> RobotBody:
    """Put a hull on wheels: casters where two wheels would let it fall, and a footprint where none is given."""
    hull = (*parts, *(guard for wheel in wheels for guard in guards(wheel, parts)))
    outline = footprint(hull)
    casters: tuple[Solid, ...] = ()
    if spec.drive.type == "differential":
        chassis, casters = on_casters(chassis, outline, min(wheel.radius for wheel in wheels))
    given = None if spec.footprint is None else tuple((x, y) for x, y in spec.footprint)
    corners = circle(spec.radius) if spec.radius is not None else given or outline
    wheels = motorised(wheels, spec.drive, chassis.mass + sum(wheel.inertia.mass for wheel in wheels))
    return RobotBody(spec.name, hull, casters, wheels, chassis, _anticlockwise(corners), spec.radius, spec.drive,
                     spec.limits)  # fmt: skip


def _anticlockwise(polygon: Polygon) -> Polygon:
    ends = (*polygon[1:], polygon[0])
    area = sum(ax * by - bx * ay for (ax, ay), (bx, by) in zip(polygon, ends, strict=True))
    return polygon if area > 0 else polygon[::-1]
