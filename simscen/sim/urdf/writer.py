"""Writes the body of a robot as URDF, for the topic /robot_description of a log."""

import math
from xml.etree import ElementTree as ET

from simscen.core.geometry import Array, Pose3, Vector
from simscen.core.geometry.shapes import Box, Capsule, Cylinder, Solid, Sphere
from simscen.sim.body.outline import hull_points
from simscen.sim.body.robot_body import RobotBody
from simscen.sim.body.undercarriage import Wheel

BASE_LINK = "base_link"


def to_urdf(body: RobotBody) -> str:
    """Return URDF text: a base link with the hull and casters, and a continuous joint with a link for each wheel.

    Boxes, cylinders, and spheres are kept. Capsules become cylinders, and all other shapes become bounding boxes.
    """
    robot = ET.Element("robot", name=body.name)
    base = ET.SubElement(robot, "link", name=BASE_LINK)
    center = Pose3(*body.chassis.center.tolist())
    _add_inertial(base, body.chassis.mass, center, body.chassis.tensor)
    for solid in (*body.hull, *body.casters):
        _add_shape(base, solid)
    for wheel in body.wheels:
        _add_wheel(robot, wheel)
    ET.indent(robot)
    return ET.tostring(robot, encoding="unicode", xml_declaration=True) + "\n"


def _add_wheel(robot: ET.Element, wheel: Wheel) -> None:
    link = ET.SubElement(robot, "link", name=f"{wheel.name}_link")
    _add_inertial(link, wheel.inertia.mass, Pose3(), wheel.inertia.tensor)
    _add_shape(link, Solid(Cylinder(wheel.radius, wheel.width), Pose3.from_rpy(0, 0, 0, math.pi / 2, 0, 0)))
    joint = ET.SubElement(robot, "joint", name=wheel.name, type="continuous")
    ET.SubElement(joint, "parent", link=BASE_LINK)
    ET.SubElement(joint, "child", link=f"{wheel.name}_link")
    ET.SubElement(joint, "origin", xyz=_join_numbers(wheel.x, wheel.y, wheel.radius), rpy="0 0 0")
    ET.SubElement(joint, "axis", xyz="0 1 0")


def _add_inertial(link: ET.Element, mass: float, center: Pose3, tensor: Array) -> None:
    inertial = ET.SubElement(link, "inertial")
    _add_origin(inertial, center)
    ET.SubElement(inertial, "mass", value=_join_numbers(mass))
    names = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2), "izz": (2, 2)}
    ET.SubElement(inertial, "inertia", {name: _join_numbers(tensor[index]) for name, index in names.items()})


def _add_shape(link: ET.Element, solid: Solid) -> None:
    for kind in ("visual", "collision"):
        element = ET.SubElement(link, kind)
        geometry = ET.SubElement(element, "geometry")
        pose = solid.pose
        match solid.shape:
            case Box(size):
                ET.SubElement(geometry, "box", size=_join_numbers(*size))
            case Cylinder(radius, length) | Capsule(radius, length):
                ET.SubElement(geometry, "cylinder", radius=_join_numbers(radius), length=_join_numbers(length))
            case Sphere(radius):
                ET.SubElement(geometry, "sphere", radius=_join_numbers(radius))
            case other:
                low, high = hull_points(other).min(axis=0), hull_points(other).max(axis=0)
                ET.SubElement(geometry, "box", size=_join_numbers(*(high - low).tolist()))
                pose = pose.compose(Pose3(*((low + high) / 2).tolist()))
        _add_origin(element, pose)


def _add_origin(element: ET.Element, pose: Pose3) -> None:
    angles = _roll_pitch_yaw(pose)
    ET.SubElement(element, "origin", xyz=_join_numbers(*pose.position), rpy=_join_numbers(*angles))


def _roll_pitch_yaw(pose: Pose3) -> Vector:
    """Return the angles in rad whose rotations about the fixed axes x, y, and z, in this order, give the rotation."""
    x, y, z, w = pose.quaternion
    sine = 2 * (w * y - z * x)
    if abs(sine) > 1 - 1e-12:  # pitched by 90 degrees, only the sum or difference of roll and yaw is determined
        return 0.0, math.copysign(math.pi / 2, sine), math.copysign(2.0, sine) * math.atan2(-x, w)
    return math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)), math.asin(sine), pose.yaw


def _join_numbers(*values: float) -> str:
    return " ".join(f"{value:.9g}" for value in values)
