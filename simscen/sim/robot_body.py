"""A robot made ready for physics: one rigid hull, wheels where its drive needs them. Needs no engine."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from simscen.core.geometry import Pose3
from simscen.core.shapes import Box, Cylinder, Mesh, Solid, Sphere
from simscen.core.world import Polygon
from simscen.model.robot import Ackermann, Differential, Drive, Limits, Omnidirectional, RobotSpec, SkidSteer
from simscen.sim.inertia import MassProperties, of_shape, of_solids
from simscen.sim.outline import circle, footprint

WHEEL_SHARE = 0.03
"""A wheel's share of the mass, where nobody says: those of a TurtleBot3 and of a Jackal weigh 2 to 3 %."""
ROTOR = {"differential": 0.25, "ackermann": 0.25, "skid_steer": 0.5}
"""Rotor inertia of a wheel's motor as seen through the gear, in units of robot mass x wheel radius².

The square of the gear ratio makes it far larger than that of the wheel itself. It also is what lets ten solver
iterations converge: without it a resting robot creeps at 1.1 mm/s, with it at 2 µm/s. Where wheels skid it keeps
friction nearer to opposite to the slip, as Coulomb has it; yet a rotor that is spun up turns the chassis the other
way, and with 1.0 a Jackal somersaults at 5 m/s².
"""
TRACTION = {"differential": 0.7, "ackermann": 0.7, "skid_steer": 1.5}
"""Stall torque of a motor over what spins its wheel on the spot.

Differential drives stall against a wall rather than spin; skid steering needs more than its grip, to start the
rotors as well.
"""
LOW = 0.5
"""Height of the centre of mass over that of the hull's volume: batteries and motors lie at the bottom."""
GRAVITY = 9.81
"""m/s² down."""
BALLAST = 0.1
"""How far behind the axle the mass of a symmetric robot sits, as a fraction of the way to the caster.

With the mass exactly over the axle the robot rocks between its casters and the load on the wheels is left to the
solver: they then slip 4 % when accelerating with 1 m/s², instead of 0.1 %.
"""
CASTER_GAP = 0.001
"""How far the unloaded caster hangs above the ground in m."""

MeshReader = Callable[[Path], Mesh]


@dataclass(frozen=True, eq=False)
class Wheel:
    """A wheel with its centre at `x`, `y` in the base frame, `radius` above the ground; all in metres.

    It turns about y. A driven one has a motor with `torque` in N m and a `rotor` in kg m².
    """

    name: str
    x: float
    y: float
    radius: float
    width: float
    inertia: MassProperties
    driven: bool = True
    steered: bool = False
    torque: float = 0.0
    rotor: float = 0.0

    @property
    def left(self) -> bool:
        """On which side it is."""
        return self.y > 0


@dataclass(frozen=True, eq=False)
class RobotBody:
    """Everything needed to build a robot, in its base frame: on the ground under the middle of its axle.

    `hull` is what touches obstacles; `casters` glide on the ground without friction; wheels roll on it. `chassis` is
    the mass of all but the wheels. `footprint` is anticlockwise; `radius` is set for a round robot.
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
    def circumscribed_radius(self) -> float:
        """The smallest circle around the base's origin that holds the footprint, in metres."""
        return max(math.hypot(x, y) for x, y in self.footprint)


def robot_body(
    spec: RobotSpec, file: Path | None = None, roots: Sequence[Path] = (), read_mesh: MeshReader | None = None
) -> RobotBody:
    """The body of a robot as specified.

    `file` is the `*.robot.yaml`, to which `spec.urdf` is relative; `roots` are the folders that the URDF and its
    meshes must lie in; `read_mesh` reads a mesh file. Raises InvalidInput when the URDF cannot be used.
    """
    if spec.urdf is not None:
        from simscen.sim.urdf.body import body_of_urdf

        return body_of_urdf(spec, file, roots, read_mesh)
    return _of_shapes(spec)


def _of_shapes(spec: RobotSpec) -> RobotBody:
    assert spec.body is not None and spec.mass is not None  # RobotSpec promises it
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
    hull = (*parts, *(guard for wheel in wheels for guard in _guards(wheel, parts)))
    outline = footprint(hull)
    casters: tuple[Solid, ...] = ()
    if spec.drive.type == "differential":
        chassis, casters = _on_casters(chassis, outline, min(wheel.radius for wheel in wheels))
    given = None if spec.footprint is None else tuple((x, y) for x, y in spec.footprint)
    corners = circle(spec.radius) if spec.radius is not None else given or outline
    wheels = _motorised(wheels, spec.drive, chassis.mass + sum(wheel.inertia.mass for wheel in wheels))
    return RobotBody(spec.name, hull, casters, wheels, chassis, _anticlockwise(corners), spec.radius, spec.drive,
                     spec.limits)  # fmt: skip


def _motorised(wheels: tuple[Wheel, ...], drive: Drive, mass: float) -> tuple[Wheel, ...]:
    grip = mass * GRAVITY / max(1, sum(wheel.driven for wheel in wheels))
    return tuple(
        replace(
            wheel, torque=TRACTION[drive.type] * grip * wheel.radius, rotor=ROTOR[drive.type] * mass * wheel.radius**2
        )
        if wheel.driven
        else wheel
        for wheel in wheels
    )


def wheels_of(drive: Drive, mass: float) -> tuple[Wheel, ...]:
    """The wheels of a drive, rear before front and left before right; none for an omnidirectional one."""
    match drive:
        case Omnidirectional():
            return ()
        case Differential():
            axles = {"wheel": 0.0}
        case SkidSteer():
            axles = {"rear": -drive.wheel_base / 2, "front": drive.wheel_base / 2}
        case Ackermann():
            axles = {"rear": 0.0, "front": drive.wheel_base}
    inertia = wheel_inertia(WHEEL_SHARE * mass, drive.wheel_radius, drive.wheel_width)
    half = drive.wheel_separation / 2
    return tuple(
        Wheel(f"{axle}_{side}", x, y, drive.wheel_radius, drive.wheel_width, inertia, driven=not steered,
              steered=steered)
        for axle, x in axles.items()
        for steered in [isinstance(drive, Ackermann) and axle == "front"]
        for side, y in (("left", half), ("right", -half))
    )  # fmt: skip


def wheel_inertia(mass: float, radius: float, width: float) -> MassProperties:
    """A wheel as a disc that turns about y."""
    return of_shape(Cylinder(radius, width), mass).placed(Pose3.from_rpy(0, 0, 0, math.pi / 2, 0, 0))


def _guards(wheel: Wheel, parts: Sequence[Solid]) -> tuple[Solid, ...]:
    """What of a wheel can touch an obstacle: a box around it, unless the hull hides it.

    It ends above the ground and below the wheel's top, so that it never carries weight.
    """
    box = Solid(
        Box((2 * wheel.radius, wheel.width, 1.2 * wheel.radius)), Pose3(wheel.x, wheel.y, wheel.radius), "wheel"
    )
    hidden = any(_holds(footprint([part]), footprint([box])) for part in parts)
    return () if hidden else (box,)


def _holds(outer: Polygon, inner: Polygon) -> bool:
    edges = list(zip(outer, (*outer[1:], outer[0]), strict=True))
    return all((bx - ax) * (y - ay) - (by - ay) * (x - ax) >= -1e-6 for (ax, ay), (bx, by) in edges for x, y in inner)


def _on_casters(
    chassis: MassProperties, outline: Polygon, wheel_radius: float
) -> tuple[MassProperties, tuple[Solid, ...]]:
    """Balls before and behind the axle; the mass leans on one of them, the other hangs a hair above the ground."""
    radius = 0.5 * wheel_radius
    front = 0.9 * (max(x for x, _ in outline) - radius)
    rear = 0.9 * (min(x for x, _ in outline) + radius)
    centre = chassis.centre.copy()
    loaded = front if centre[0] > BALLAST * front else rear
    if abs(centre[0]) < BALLAST * abs(loaded):
        centre[0] = BALLAST * loaded
    gaps = {front: CASTER_GAP, rear: CASTER_GAP} | {loaded: 0.0}
    balls = tuple(Solid(Sphere(radius), Pose3(x, 0.0, radius + gap), "caster") for x, gap in gaps.items())
    return MassProperties(chassis.mass, centre, chassis.tensor), balls


def _anticlockwise(polygon: Polygon) -> Polygon:
    ends = (*polygon[1:], polygon[0])
    area = sum(ax * by - bx * ay for (ax, ay), (bx, by) in zip(polygon, ends, strict=True))
    return polygon if area > 0 else polygon[::-1]
