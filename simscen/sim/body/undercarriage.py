"""Wheels, casters, and motors below the hull of a robot."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

from simscen.core.environment.world_model import GRAVITY_M_S2
from simscen.core.geometry import Polygon, Pose3
from simscen.core.geometry.shapes import Box, Cylinder, Solid, Sphere
from simscen.model.robot import Ackermann, Differential, Drive, Mecanum, Omnidirectional, SkidSteer
from simscen.sim.body.inertia import MassProperties, inertia_of_shape
from simscen.sim.body.outline import footprint

WHEEL_MASS_RATIO = 0.03
"""Default mass of a wheel divided by the mass of the robot."""
ROTOR_INERTIA_RATIO = {"differential": 0.25, "ackermann": 0.25, "skid_steer": 0.5}
"""Rotor inertia of a wheel's motor at the gear output, divided by robot mass x wheel radius², for each type of drive.

With a smaller inertia, a robot at rest creeps. With a larger inertia, accelerating tips the robot.
"""
STALL_TORQUE_RATIO = {"differential": 0.7, "ackermann": 0.7, "skid_steer": 1.5}
"""Stall torque of a wheel's motor divided by the torque at which the wheel slips, for each type of drive."""
MIN_MASS_OFFSET_RATIO = 0.1
"""Smallest distance of the center of mass from the axle, divided by the distance of the loaded caster from the axle.

With the center of mass exactly above the axle, the robot would rock between its casters.
"""
CASTER_GAP_M = 0.001
"""Height of the unloaded caster above flat ground in m."""
UNEVEN_CASTER_GAP_RATIO = math.tan(math.radians(8))
"""Height of the unloaded caster above uneven ground, divided by its distance from the axle.

The gap keeps the wheels on the ground at the foot of a ramp. The robot tips by 8° before the caster carries weight.
"""


@dataclass(frozen=True, eq=False)
class Wheel:
    """A wheel on the ground that turns about the y axis. Its center is at `x`, `y` in the base frame. Lengths are in m.

    The motor of a driven wheel has a `stall_torque` in N m and a `rotor_inertia` at the gear output in kg m².
    """

    name: str
    x: float
    y: float
    radius: float
    width: float
    inertia: MassProperties
    is_driven: bool = True
    is_steered: bool = False
    stall_torque: float = 0.0
    rotor_inertia: float = 0.0

    @property
    def is_left(self) -> bool:
        """Whether the wheel is on the left side."""
        return self.y > 0


def wheels_for_drive(drive: Drive, mass: float) -> tuple[Wheel, ...]:
    """Return the wheels of a drive, without motors, rear before front and left before right.

    Returns () for an omnidirectional drive. `mass` is the mass of the robot in kg.
    """
    match drive:
        case Omnidirectional():
            return ()
        case Differential():
            axles = {"wheel": 0.0}
        case SkidSteer() | Mecanum():
            axles = {"rear": -drive.wheel_base / 2, "front": drive.wheel_base / 2}
        case Ackermann():
            axles = {"rear": 0.0, "front": drive.wheel_base}
    inertia = wheel_inertia(WHEEL_MASS_RATIO * mass, drive.wheel_radius, drive.wheel_width)
    half = drive.wheel_separation / 2
    return tuple(
        Wheel(f"{axle}_{side}", x, y, drive.wheel_radius, drive.wheel_width, inertia, is_driven=not is_steered,
              is_steered=is_steered)
        for axle, x in axles.items()
        for is_steered in [isinstance(drive, Ackermann) and axle == "front"]
        for side, y in (("left", half), ("right", -half))
    )  # fmt: skip


def wheel_inertia(mass: float, radius: float, width: float) -> MassProperties:
    """Return the mass properties of a wheel: a disc around the y axis with its center at the origin."""
    return inertia_of_shape(Cylinder(radius, width), mass).transformed(Pose3.from_rpy(0, 0, 0, math.pi / 2, 0, 0))


def add_motors(wheels: tuple[Wheel, ...], drive: Drive, mass: float) -> tuple[Wheel, ...]:
    """Return the wheels with motors for a robot of `mass` kg; mecanum wheels get no motors."""
    if isinstance(drive, Mecanum):
        return wheels
    grip = mass * GRAVITY_M_S2 / max(1, sum(wheel.is_driven for wheel in wheels))
    return tuple(
        replace(
            wheel,
            stall_torque=STALL_TORQUE_RATIO[drive.type] * grip * wheel.radius,
            rotor_inertia=ROTOR_INERTIA_RATIO[drive.type] * mass * wheel.radius**2,
        )
        if wheel.is_driven
        else wheel
        for wheel in wheels
    )


def wheel_guards(wheels: Iterable[Wheel], parts: Iterable[Solid]) -> tuple[Solid, ...]:
    """Return boxes around the wheels, which collide with obstacles instead of the wheels.

    The boxes do not touch the ground. `parts` are the solids of the hull. A wheel that a part covers, seen from
    above, gets no box.
    """
    outlines = [footprint([part]) for part in parts]
    boxes = (
        Solid(Box((2 * wheel.radius, wheel.width, 1.2 * wheel.radius)), Pose3(wheel.x, wheel.y, wheel.radius), "wheel")
        for wheel in wheels
    )
    return tuple(box for box in boxes if not any(_contains(outline, footprint([box])) for outline in outlines))


def _contains(outer: Polygon, inner: Polygon) -> bool:
    """Return whether a convex, counterclockwise polygon contains another polygon."""
    edges = list(zip(outer, (*outer[1:], outer[0]), strict=True))
    return all((bx - ax) * (y - ay) - (by - ay) * (x - ax) >= -1e-6 for (ax, ay), (bx, by) in edges for x, y in inner)


def add_casters(
    chassis: MassProperties, outline: Polygon, wheel_radius: float
) -> tuple[MassProperties, tuple[Solid, ...]]:
    """Return the chassis and two casters, one in front of the axle and one behind it.

    The loaded caster touches the ground. The front caster is loaded if the center of mass is in front of the axle by
    more than MIN_MASS_OFFSET_RATIO, otherwise the rear caster. The other caster is CASTER_GAP_M above the ground. A
    center of mass too near to the axle is shifted towards the loaded caster (see MIN_MASS_OFFSET_RATIO). `outline` is
    the outline of the hull from above.
    """
    radius = 0.5 * wheel_radius
    front = 0.9 * (max(x for x, _ in outline) - radius)
    rear = 0.9 * (min(x for x, _ in outline) + radius)
    center = chassis.center.copy()
    loaded = front if center[0] > MIN_MASS_OFFSET_RATIO * front else rear
    if abs(center[0]) < MIN_MASS_OFFSET_RATIO * abs(loaded):
        center[0] = MIN_MASS_OFFSET_RATIO * loaded
    gaps = {front: CASTER_GAP_M, rear: CASTER_GAP_M} | {loaded: 0.0}
    casters = tuple(Solid(Sphere(radius), Pose3(x, 0.0, radius + gap), "caster") for x, gap in gaps.items())
    return MassProperties(chassis.mass, center, chassis.tensor), casters


def casters_for_uneven_ground(casters: Sequence[Solid]) -> tuple[Solid, ...]:
    """Return the casters for uneven ground: the unloaded caster is higher, as UNEVEN_CASTER_GAP_RATIO states."""
    adapted = []
    for caster in casters:
        if (gap := caster_gap(caster)) > 0:
            uneven_gap = UNEVEN_CASTER_GAP_RATIO * math.hypot(caster.pose.x, caster.pose.y)
            adapted.append(replace(caster, pose=caster.pose._replace(z=caster.pose.z - gap + uneven_gap)))
        else:
            adapted.append(caster)
    return tuple(adapted)


def caster_gap(caster: Solid) -> float:
    """Return the height of a caster above level ground in m."""
    assert isinstance(caster.shape, Sphere)
    return round(caster.pose.z - caster.shape.radius, 9)
