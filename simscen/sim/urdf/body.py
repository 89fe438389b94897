"""Builds the body of a robot from a URDF."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from simscen.assets.folders import AllowedFolders, UnusableFile
from simscen.core.errors import InvalidInput, Problem
from simscen.core.geometry import Pose3
from simscen.core.geometry.shapes import Cylinder, Solid, Sphere
from simscen.model.robot import Mecanum, Omnidirectional, RobotSpec
from simscen.sim.body.inertia import MassProperties, combine, inertia_of_solids
from simscen.sim.body.outline import hull_points
from simscen.sim.body.robot_body import MIN_GROUND_CLEARANCE_M, RobotBody, assemble_body
from simscen.sim.body.undercarriage import Wheel, wheel_inertia
from simscen.sim.urdf.elements import MeshReader, MeshSource
from simscen.sim.urdf.link_tree import LinkTree, build_tree
from simscen.sim.urdf.wheels import WheelJoint, check_front_steering, describe_wheels, examine_joints, select_wheels
from simscen.sim.urdf.xacro.expand import UnknownArgument, expand
from simscen.sim.urdf.xml_source import URDF_ERROR_CODE, RobotFiles, read_xml

MAX_CASTER_SIZE_RATIO = 0.35
"""Largest length and width of a caster that is not round, divided by the length and width of the hull."""
MAX_CASTER_AXIS_Z = 0.1
"""Largest z component of the axis of a cylinder that is a caster (6 degrees)."""
MIN_INERTIA_RATIO = 1e-6
"""Smallest principal moment of inertia divided by the sum of all three. A smaller moment counts as missing."""
ROUNDING_M = 1e-6
"""Rounding error in m of a radius that a xacro file computes."""


def read_spec_tree(
    spec: RobotSpec,
    file: Path | None,
    roots: Sequence[Path],
    read_mesh: MeshReader | None,
    robot_files: RobotFiles | None,
) -> LinkTree:
    """Read the links and joints of the URDF of a robot. Raises InvalidInput.

    `file` is the `*.robot.yaml`. The URDF is at the path in `robot_files`, or by default at `spec.urdf` relative to
    `file`. All files must be in `roots` (default: the folder of `file`). Without `read_mesh`, the URDF must not have
    meshes.
    """
    assert spec.urdf is not None
    folder = (file or Path()).resolve().parent
    folders = AllowedFolders.of(roots or (folder,), robot_files.packages if robot_files else None)
    try:
        path = robot_files.urdf if robot_files else folders.find(spec.urdf, folder)
    except UnusableFile as error:
        shown_path = folders.display_path(file.resolve()) if file else ""
        message = f"urdf {spec.urdf[:200]!r}: {error}"
        raise InvalidInput([Problem(shown_path, 0, 0, URDF_ERROR_CODE, message)]) from error
    arguments = {
        name: str(value).lower() if isinstance(value, bool) else str(value) for name, value in spec.arguments.items()
    }
    return read_tree(path, folders, read_mesh, arguments)


def read_tree(
    path: Path, folders: AllowedFolders, read_mesh: MeshReader | None, arguments: Mapping[str, str] | None = None
) -> LinkTree:
    """Read the links and joints of a URDF or xacro file. `arguments` are xacro arguments. Raises InvalidInput."""
    path = folders.resolve_parent(path)
    robot = read_xml(path, folders)
    is_xacro = path.suffix == ".xacro" or "xmlns:xacro" in robot.attributes
    if is_xacro:
        defines_macros = any(robot.all("xacro:macro"))
        robot = expand(robot, path, folders, lambda included: read_xml(included, folders), arguments)
        if defines_macros and not any(robot.all("link")):
            hint = "use the file that includes it and calls its macros"
            raise InvalidInput([robot.problem("the file defines macros but does not use them", hint)])
    elif arguments:
        raise UnknownArgument(robot, next(iter(arguments)), ())
    return build_tree(robot, MeshSource(path.parent, folders, read_mesh, is_xacro))


def body_from_tree(spec: RobotSpec, tree: LinkTree) -> RobotBody:
    """Build the body of a robot from its links. All joints except wheel joints are fixed at 0. Raises InvalidInput."""
    joints = select_wheels(tree, spec.drive)
    _check_wheels(spec, tree, joints)
    rolling_links = {link for wheel in joints for link in tree.subtree(wheel.joint.child)}
    fixed_links = [name for name in tree.links if name not in rolling_links]
    solids = [
        Solid(solid.shape, tree.poses[name].compose(solid.pose), name)
        for name in fixed_links
        for solid in tree.links[name].solids
    ]
    if not solids:
        raise InvalidInput([tree.element.problem("no link has a <collision>, so nothing of the robot can collide")])
    base_from_root = _base_from_root(joints, solids)
    hull = tuple(replace(solid, pose=base_from_root.compose(solid.pose)) for solid in solids)
    scale = _mass_scale(spec, tree)
    chassis = _with_valid_inertia(_combine_masses(tree, fixed_links, base_from_root, scale), hull)
    wheels = tuple(_build_wheel(tree, joint, base_from_root, scale, spec) for joint in joints)
    if wheels:  # an omnidirectional base has no ground contact
        hull = _without_casters(tree, hull, max(wheel.radius for wheel in wheels))
    return assemble_body(spec, hull, wheels, chassis)


def _check_wheels(spec: RobotSpec, tree: LinkTree, wheels: list[WheelJoint]) -> None:
    """Raise InvalidInput if the wheels do not fit the type of drive."""
    if isinstance(spec.drive, Omnidirectional):
        return
    if isinstance(spec.drive, Mecanum):
        _check_corners(tree, wheels)
    driven = [wheel for wheel in wheels if not wheel.is_steered]
    if len({wheel.is_left for wheel in driven}) < 2:
        hint = "name the wheel joints in the drive's `left` and `right`"
        message = f"no driven wheels found on both sides: {describe_wheels(*examine_joints(tree))}"
        raise InvalidInput([tree.element.problem(message, hint)])
    if spec.drive.type == "ackermann" and not any(wheel.is_steered for wheel in wheels):
        hint = "name the steering joints in the drive's `steering`"
        raise InvalidInput([tree.element.problem("no steered wheels found", hint)])
    check_front_steering(wheels)


def _check_corners(tree: LinkTree, wheels: list[WheelJoint]) -> None:
    """Raise InvalidInput unless there are four wheels, one at each corner."""
    middle = np.mean([wheel.center[:2] for wheel in wheels], axis=0) if wheels else (0.0, 0.0)
    corners = {(wheel.center[0] > middle[0], wheel.center[1] > middle[1]) for wheel in wheels}
    if len(wheels) != 4 or len(corners) != 4:
        names = ", ".join(wheel.joint.name for wheel in wheels) or "none"
        message = f"a mecanum drive has one wheel at each of four corners; found: {names[:200]}"
        hint = "name the four wheel joints in the drive's `left` and `right`"
        raise InvalidInput([tree.element.problem(message, hint)])


def _base_from_root(wheels: list[WheelJoint], solids: Sequence[Solid]) -> Pose3:
    """Return the pose of the root frame in the base frame, which is on the ground, centered below the driven axles."""
    if not wheels:
        lowest = [solid.pose.apply(hull_points(solid.shape))[:, 2].min() for solid in solids]
        return Pose3(0.0, 0.0, -float(min(lowest)))
    x, y, _ = np.mean([wheel.center for wheel in wheels if not wheel.is_steered], axis=0).tolist()
    return Pose3(-x, -y, -min(wheel.bottom for wheel in wheels))


def _mass_scale(spec: RobotSpec, tree: LinkTree) -> float:
    """Return the factor that makes the sum of all masses equal to the specified mass; 1 if no mass is specified."""
    total = sum(link.mass.mass for link in tree.links.values() if link.mass is not None)
    if total <= 0:
        raise InvalidInput([tree.element.problem("no link has a mass", "give its <inertial> a <mass>")])
    return spec.mass / total if spec.mass is not None else 1.0


def _combine_masses(tree: LinkTree, links: Sequence[str], base_from_root: Pose3, scale: float) -> MassProperties:
    """Return the mass properties of the links together in the base frame, with their masses multiplied by `scale`."""
    masses = [(tree.poses[name], tree.links[name].mass) for name in links]
    parts = [
        mass.transformed(base_from_root.compose(pose)) for pose, mass in masses if mass is not None and mass.mass > 0
    ]
    if not parts:
        raise InvalidInput([tree.element.problem("no link besides the wheels has a mass; give one an <inertial>")])
    whole = combine(parts)
    return MassProperties(whole.mass * scale, whole.center, whole.tensor * scale)


def _with_valid_inertia(chassis: MassProperties, solids: Sequence[Solid]) -> MassProperties:
    """Return the chassis. If a moment of inertia is missing or negative, use the inertia of solids of uniform density.

    With a missing or negative moment, the wheels could not move the robot as commanded.
    """
    if np.linalg.eigvalsh(chassis.tensor)[0] > MIN_INERTIA_RATIO * np.trace(chassis.tensor):
        return chassis
    return replace(chassis, tensor=inertia_of_solids(solids, chassis.mass).tensor)


def _build_wheel(tree: LinkTree, wheel: WheelJoint, base_from_root: Pose3, scale: float, spec: RobotSpec) -> Wheel:
    """Return the wheel on a joint, with the mass of all links below the joint multiplied by `scale`."""
    x, y, _ = base_from_root.compose(Pose3(*wheel.center)).position
    links = [(tree.poses[name], tree.links[name].mass) for name in tree.subtree(wheel.joint.child)]
    parts = [mass.transformed(pose) for pose, mass in links if mass is not None and mass.mass > 0]
    mass = scale * sum(part.mass for part in parts)
    if mass <= 0:
        raise InvalidInput([wheel.joint.element.problem(f"the wheel on joint {wheel.joint.name!r} has no mass")])
    inertia = wheel_inertia(mass, wheel.radius, wheel.width)
    is_car = spec.drive.type == "ackermann"
    return Wheel(
        wheel.joint.name, x, y, wheel.radius, wheel.width, inertia, is_driven=not (is_car and wheel.is_steered),
        is_steered=is_car and wheel.is_steered,
    )  # fmt: skip


def _without_casters(tree: LinkTree, hull: tuple[Solid, ...], wheel_radius: float) -> tuple[Solid, ...]:
    """Return the hull without casters: small or round parts that touch the ground.

    `wheel_radius` is the radius of the largest wheel in m. Raises InvalidInput if any other part touches the ground.
    """
    points = [solid.pose.apply(hull_points(solid.shape)) for solid in hull]
    hull_size = np.ptp(np.concatenate(points)[:, :2], axis=0)
    kept = []
    for solid, corners in zip(hull, points, strict=True):
        height = corners[:, 2].min()
        if height >= MIN_GROUND_CLEARANCE_M:
            kept.append(solid)
        elif not (
            (np.ptp(corners[:, :2], axis=0) <= MAX_CASTER_SIZE_RATIO * hull_size).all()
            or _is_round_caster(solid, wheel_radius)
        ):
            relation = f"is {1e3 * height:.1f} mm above" if height >= 0 else f"reaches {-1e3 * height:.1f} mm below"
            message = f"link {solid.name!r} {relation} the lowest point of the wheels: it would drag over the ground"
            hint = f"its <collision> must be at least {1e3 * MIN_GROUND_CLEARANCE_M:g} mm above this point"
            raise InvalidInput([tree.links[solid.name].element.problem(message, hint)])
    return tuple(kept)


def _is_round_caster(solid: Solid, wheel_radius: float) -> bool:
    """Return whether a part is a ball, or a horizontal cylinder like a wheel, of at most `wheel_radius` m."""
    match solid.shape:
        case Sphere(radius):
            return radius <= wheel_radius + ROUNDING_M
        case Cylinder(radius, length):
            axis = solid.pose._replace(x=0.0, y=0.0, z=0.0).compose(Pose3(0.0, 0.0, 1.0)).position
            return radius <= wheel_radius + ROUNDING_M and length <= 2 * radius and abs(axis[2]) <= MAX_CASTER_AXIS_Z
        case _:
            return False
