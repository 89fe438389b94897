"""Wheels, casters and motors: what a hull stands on."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from simscen.core.environment.world_model import Polygon
from simscen.core.geometry import Pose3
from simscen.core.geometry.shapes import Box, Cylinder, Solid, Sphere
from simscen.model.robot import Ackermann, Differential, Drive, Mecanum, Omnidirectional, SkidSteer
from simscen.sim.body.inertia import GRAVITY, MassProperties, inertia_of_shape
from simscen.sim.body.outline import footprint

WHEEL_MASS_SHARE = 0.03
"""A wheel's share of the mass, where nobody says: those of a TurtleBot3 and of a Jackal weigh 2 to 3 %."""
ROTOR_INERTIA = {"differential": 0.25, "ackermann": 0.25, "skid_steer": 0.5}
"""Rotor inertia of a wheel's motor as seen through the gear, in units of robot mass x wheel radius².

The square of the gear ratio makes it far larger than that of the wheel itself. It also is what lets ten solver
iterations converge: without it a resting robot creeps at 1.1 mm/s, with it at 2 µm/s. Where wheels skid it keeps
friction nearer to opposite to the slip, as Coulomb has it; yet a rotor that is spun up turns the chassis the other
way, and with 1.0 a Jackal somersaults at 5 m/s².
"""
STALL_TORQUE = {"differential": 0.7, "ackermann": 0.7, "skid_steer": 1.5}
"""Stall torque of a motor over what spins its wheel on the spot.

Differential drives stall against a wall rather than spin; skid steering needs more than its grip, to start the
rotors as well.
"""
MASS_OFFSET_SHARE = 0.1
"""How far behind the axle the mass of a symmetric robot sits, as a fraction of the way to the caster.

With the mass exactly over the axle the robot rocks between its casters and the load on the wheels is left to the
solver: they then slip 4 % when accelerating with 1 m/s², instead of 0.1 %.
"""
CASTER_GAP_M = 0.001
"""How far the unloaded caster hangs above the ground in m."""
UNEVEN_CASTER_GAP_RATIO = math.tan(math.radians(8))
"""How far the unloaded caster hangs on uneven ground, over its distance from the axle.

Wheels between two rigid casters hang in the air at the foot of a ramp. Real bases have sprung ones, or sprung wheels;
here the loaded caster and the wheels stand on the ground, and the other catches a robot that tips by 8°.
"""


@dataclass(frozen=True, eq=False)
class Wheel:
    """A wheel with its center at `x`, `y` in the base frame, `radius` above the ground; all in meters.

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


def wheels_for_drive(drive: Drive, mass: float) -> tuple[Wheel, ...]:
    """Return the wheels of a drive, rear before front and left before right; none for an omnidirectional one."""
    match drive:
        case Omnidirectional():
            return ()
        case Differential():
            axles = {"wheel": 0.0}
        case SkidSteer() | Mecanum():
            axles = {"rear": -drive.wheel_base / 2, "front": drive.wheel_base / 2}
        case Ackermann():
            axles = {"rear": 0.0, "front": drive.wheel_base}
    inertia = wheel_inertia(WHEEL_MASS_SHARE * mass, drive.wheel_radius, drive.wheel_width)
    half = drive.wheel_separation / 2
    return tuple(
        Wheel(f"{axle}_{side}", x, y, drive.wheel_radius, drive.wheel_width, inertia, driven=not steered,
              steered=steered)
        for axle, x in axles.items()
        for steered in [isinstance(drive, Ackermann) and axle == "front"]
        for side, y in (("left", half), ("right", -half))
    )  # fmt: skip


def wheel_inertia(mass: float, radius: float, width: float) -> MassProperties:
    """Return the properties of a wheel as a disc that rotates about y."""
    return inertia_of_shape(Cylinder(radius, width), mass).placed(Pose3.from_rpy(0, 0, 0, math.pi / 2, 0, 0))


def add_motors(wheels: tuple[Wheel, ...], drive: Drive, mass: float) -> tuple[Wheel, ...]:
    """Return the wheels with motors for a robot of this mass in kg; a planar base has its own motors."""
    if isinstance(drive, Mecanum):
        return wheels
    grip = mass * GRAVITY / max(1, sum(wheel.driven for wheel in wheels))
    return tuple(
        replace(
            wheel,
            torque=STALL_TORQUE[drive.type] * grip * wheel.radius,
            rotor=ROTOR_INERTIA[drive.type] * mass * wheel.radius**2,
        )
        if wheel.driven
        else wheel
        for wheel in wheels
    )


def wheel_guards(wheel: Wheel, parts: Sequence[Solid]) -> tuple[Solid, ...]:
    """Return the collision shape of a wheel for obstacles: a box around it, unless the hull covers it.

    The box ends above the ground and below the top of the wheel, so that it never carries weight.
    """
    box = Solid(
        Box((2 * wheel.radius, wheel.width, 1.2 * wheel.radius)), Pose3(wheel.x, wheel.y, wheel.radius), "wheel"
    )
    hidden = any(_holds(footprint([part]), footprint([box])) for part in parts)
    return () if hidden else (box,)


def _holds(outer: Polygon, inner: Polygon) -> bool:
    edges = list(zip(outer, (*outer[1:], outer[0]), strict=True))
    return all((bx - ax) * (y - ay) - (by - ay) * (x - ax) >= -1e-6 for (ax, ay), (bx, by) in edges for x, y in inner)


def add_casters(
    chassis: MassProperties, outline: Polygon, wheel_radius: float
) -> tuple[MassProperties, tuple[Solid, ...]]:
    """Balls before and behind the axle; the mass leans on one of them, the other hangs a hair above the ground."""
    radius = 0.5 * wheel_radius
    front = 0.9 * (max(x for x, _ in outline) - radius)
    rear = 0.9 * (min(x for x, _ in outline) + radius)
    center = chassis.center.copy()
    loaded = front if center[0] > MASS_OFFSET_SHARE * front else rear
    if abs(center[0]) < MASS_OFFSET_SHARE * abs(loaded):
        center[0] = MASS_OFFSET_SHARE * loaded
    gaps = {front: CASTER_GAP_M, rear: CASTER_GAP_M} | {loaded: 0.0}
    balls = tuple(Solid(Sphere(radius), Pose3(x, 0.0, radius + gap), "caster") for x, gap in gaps.items())
    return MassProperties(chassis.mass, center, chassis.tensor), balls


def compliant_casters(casters: Sequence[Solid]) -> tuple[Solid, ...]:
    """Return the casters for uneven ground, where the unloaded one yields."""
    return tuple(_raised(caster) if caster_gap(caster) > 0 else caster for caster in casters)


def _raised(caster: Solid) -> Solid:
    gap = UNEVEN_CASTER_GAP_RATIO * math.hypot(caster.pose.x, caster.pose.y)
    return replace(caster, pose=caster.pose._replace(z=caster.pose.z - caster_gap(caster) + gap))


def caster_gap(caster: Solid) -> float:
    """How far above the ground a caster hangs on level ground, in m."""
    assert isinstance(caster.shape, Sphere)
    return round(caster.pose.z - caster.shape.radius, 9)
