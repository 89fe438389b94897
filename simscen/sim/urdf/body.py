"""Builds the body of a robot from a URDF, and infers the specification of a robot that has only a URDF."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from simscen.assets.folders import AllowedFolders, UnusableFile
from simscen.core.errors import InvalidInput, Problem
from simscen.core.geometry import Pose3
from simscen.core.geometry.shapes import Solid
from simscen.model.robot import (
    Ackermann,
    Differential,
    Drive,
    InertialUnit,
    Lidar,
    Limits,
    Mecanum,
    Mount,
    Omnidirectional,
    RobotSpec,
    Sensor,
    SkidSteer,
    WheelOdometry,
)
from simscen.sim.body.inertia import MassProperties, combine
from simscen.sim.body.outline import hull_points
from simscen.sim.body.robot_body import MIN_GROUND_CLEARANCE_M, RobotBody, assemble_body
from simscen.sim.body.undercarriage import Wheel, wheel_inertia
from simscen.sim.urdf.elements import LinkTree, MeshReader, MeshSource, build_tree
from simscen.sim.urdf.wheels import WheelJoint, examine_joints, select_wheels
from simscen.sim.urdf.xacro.expand import UnknownArgument, expand
from simscen.sim.urdf.xml_source import URDF_ERROR_CODE, RobotFiles, read_xml

AXLE_TOLERANCE_M = 0.02
"""Largest distance in m along x between wheels on the same axle."""
MAX_UPSIDE_DOWN_Z = -0.9
"""Largest z component of the z axis of a lidar that is mounted upside down."""
DEFAULT_MAX_STEERING_RAD = 0.5
"""Largest steering angle of a car whose steering joints have no limits below 90 degrees."""
MIN_STEERING_RAD, MAX_STEERING_RAD = 0.1, 1.0
"""Range to which the limit of a steering joint is clipped."""
LIDAR_NAMES = ("laser", "lidar", "scan")
"""Parts of the names of links that carry a lidar."""
ROBOT_FILE_HINT = "write a *.robot.yaml next to it with its drive, limits, and sensors; see `simscen explain robot`"


def infer_robot_spec(path: Path, roots: Sequence[Path] = (), read_mesh: MeshReader | None = None) -> RobotSpec:
    """Infer the specification of a robot from its URDF: the drive, its limits, and a lidar, odometry, and an IMU.

    A robot with steered wheels has an Ackermann drive, one with a single axle a differential drive, and any other robot
    a skid-steer drive. Limits are 1 m/s, 1.5 rad/s, 1 m/s², and 2 rad/s², or lower if the wheel joints are slower. The
    lidar is at a link with a name like LIDAR_NAMES, or on top of the robot. All files must be in `roots` (default: the
    folder of `path`). Raises InvalidInput if the file is invalid or its drive cannot be inferred.
    """
    folders = AllowedFolders.of(roots or (path.resolve().parent,))
    tree = read_tree(path, folders, read_mesh)
    wheels, others = examine_joints(tree)
    drive = _infer_drive(tree, wheels, others)
    draft = RobotSpec(
        simscen=1,
        name=tree.name.lstrip("/") or path.stem,
        urdf=path.name,
        drive=drive,
        limits=_infer_limits(wheels, drive),
        sensors={},
    )
    sensors = {
        "lidar": Sensor(lidar=Lidar(mount=_infer_lidar_mount(tree, draft, wheels))),
        "odom": Sensor(odometry=WheelOdometry()),
        "imu": Sensor(imu=InertialUnit()),
    }
    return draft.model_copy(update={"sensors": sensors})


def _infer_drive(tree: LinkTree, wheels: list[WheelJoint], others: Mapping[str, list[str]]) -> Drive:
    driven = [wheel for wheel in wheels if not wheel.is_steered]
    left, right = ([w for w in driven if w.is_left is side] for side in (True, False))
    if not left or len(left) != len(right):
        message = f"the drive of the robot cannot be inferred from its wheels: {_describe_wheels(wheels, others)}"
        raise InvalidInput([tree.element.problem(message, ROBOT_FILE_HINT)])
    separation = float(np.mean([w.center[1] for w in left]) - np.mean([w.center[1] for w in right]))
    axles = [w.center[0] for w in driven]
    radius, width = (float(np.mean(values)) for values in zip(*((w.radius, w.width) for w in driven), strict=True))
    size = {"wheel_radius": radius, "wheel_separation": separation, "wheel_width": width}
    steered = [wheel for wheel in wheels if wheel.is_steered and not wheel.is_caster]
    if steered:
        _check_front_steering([*driven, *steered])
        base = float(np.mean([wheel.center[0] for wheel in steered]) - np.mean(axles))
        steering = _max_steering(steered, separation / (2 * base))
        return Ackermann.model_validate({"type": "ackermann", "wheel_base": base, "max_steering": steering, **size})
    if max(axles) - min(axles) < AXLE_TOLERANCE_M:
        return Differential.model_validate({"type": "differential", **size})
    base = max(axles) - min(axles)
    scale = min(10.0, 1 + _skid_factor(axles) * (base / separation) ** 2)
    return SkidSteer.model_validate({"type": "skid_steer", "wheel_base": base, "turning_scale": scale, **size})


def _skid_factor(axles: Sequence[float]) -> float:
    """Return the factor k of turning_scale = 1 + k (wheel base / wheel separation)², for axles at x = `axles` in m.

    The factors for two, three, and more axles were measured with `simscen robot check`.
    """
    gaps = sum(after - before > AXLE_TOLERANCE_M for before, after in pairwise(sorted(axles)))
    return {1: 1.2, 2: 0.1}.get(gaps, 0.3)


def _max_steering(wheels: list[WheelJoint], ratio: float) -> float:
    """Return the largest steering angle in rad of the bicycle model, from the limits of the steering joints.

    `ratio` is wheel separation / (2 * wheel base). cot(bicycle angle) = cot(angle of the inner wheel) + ratio.
    """
    ranges = [min(-wheel.steering.limits.lower, wheel.steering.limits.upper) for wheel in wheels if wheel.steering]
    limits = [angle for angle in ranges if 0 < angle < math.pi / 2]
    if not limits:
        return DEFAULT_MAX_STEERING_RAD
    tangent = math.tan(max(MIN_STEERING_RAD, min(MAX_STEERING_RAD, *limits)))
    return math.atan(tangent / (1 + tangent * ratio))


def _describe_wheels(wheels: list[WheelJoint], others: Mapping[str, list[str]]) -> str:
    """Return a message with the names of all wheels, and the reasons why the other movable joints are not wheels."""
    if not wheels and not others:
        return "it has no movable joints"
    groups: dict[str, list[str]] = {"left": [], "right": []}
    for wheel in wheels:
        group = "steered" if wheel.is_steered else "left" if wheel.is_left else "right"
        groups.setdefault(group, []).append(wheel.joint.name)
    found = [f"{group}: {_shortened(names)}" for group, names in groups.items()]
    reasons = [f"{_shortened(names)} ({reason})" for reason, names in others.items()][:MAX_LISTED]
    return "; ".join(found + ([f"no wheels: {', '.join(reasons)}"] if reasons else []))


MAX_LISTED = 4
"""Maximum number of names, and of reasons, in a message."""


def _shortened(names: Sequence[str]) -> str:
    """Return a list of at most MAX_LISTED names for a message."""
    more = f" and {len(names) - MAX_LISTED} more" if len(names) > MAX_LISTED else ""
    return ", ".join(names[:MAX_LISTED]) + more if names else "none"


def _infer_limits(wheels: list[WheelJoint], drive: Drive) -> Limits:
    speeds = [wheel.joint.limits.velocity * wheel.radius for wheel in wheels if not wheel.is_steered]
    linear = min([1.0, *(speed for speed in speeds if speed > 0)])
    angular = min(1.5, 2 * linear / getattr(drive, "wheel_separation", 1.0))
    return Limits(linear=linear, angular=angular, linear_acceleration=1.0, angular_acceleration=2.0)


def _infer_lidar_mount(tree: LinkTree, draft: RobotSpec, wheels: list[WheelJoint]) -> Mount:
    body = body_from_tree(draft, tree)
    ground = min(wheel.bottom for wheel in wheels)
    axle = np.mean([wheel.center for wheel in wheels if not wheel.is_steered], axis=0)
    for name in tree.links:
        if any(word in name.lower() for word in LIDAR_NAMES):
            pose = tree.poses[name]
            x, y, z = float(pose.x - axle[0]), float(pose.y - axle[1]), float(pose.z - ground)
            roll = math.pi if pose.rotation()[2, 2] < MAX_UPSIDE_DOWN_Z else 0.0
            return Mount(x=x, y=y, z=max(0.0, z), roll=roll, yaw=pose.yaw)
    top = max(float(solid.pose.apply(hull_points(solid.shape))[:, 2].max()) for solid in body.hull)
    return Mount(z=top + 0.02)


MAX_CASTER_SIZE_RATIO = 0.35
"""Largest length and width of a caster, divided by the length and width of the hull."""


def read_spec_tree(
    spec: RobotSpec, file: Path | None, roots: Sequence[Path], read_mesh: MeshReader | None, located: RobotFiles | None
) -> LinkTree:
    """Read the links and joints of a robot's URDF. Raises InvalidInput.

    The URDF is at the path in `located`, or by default at `spec.urdf` relative to the robot's `file`. All files must be
    in `roots` (default: the folder of `file`). Without `read_mesh`, the URDF must not have meshes.
    """
    assert spec.urdf is not None
    folder = (file or Path()).resolve().parent
    folders = AllowedFolders.of(roots or (folder,), located.packages if located else None)
    try:
        path = located.urdf if located else folders.find(spec.urdf, folder)
    except UnusableFile as trouble:
        shown = folders.display_path(file.resolve()) if file else ""
        raise InvalidInput([Problem(shown, 0, 0, URDF_ERROR_CODE, f"urdf {spec.urdf[:200]!r}: {trouble}")]) from trouble
    return read_tree(path, folders, read_mesh, {name: _xml_text(value) for name, value in spec.arguments.items()})


def read_tree(
    path: Path, folders: AllowedFolders, read_mesh: MeshReader | None, arguments: Mapping[str, str] | None = None
) -> LinkTree:
    """Read the links and joints of a URDF or xacro file. `arguments` are xacro arguments. Raises InvalidInput."""
    path = folders.resolve_parent(path)
    robot = read_xml(path, folders)
    expanded = path.suffix == ".xacro" or "xmlns:xacro" in robot.attributes
    if expanded:
        defines_macros = any(robot.all("xacro:macro"))
        robot = expand(robot, path, folders, lambda included: read_xml(included, folders), arguments)
        if defines_macros and not any(robot.all("link")):
            hint = "use the file that includes it and calls its macros"
            raise InvalidInput([robot.problem("the file defines macros but does not use them", hint)])
    elif arguments:
        raise UnknownArgument(robot, next(iter(arguments)), ())
    return build_tree(robot, MeshSource(path.parent, folders, read_mesh, expanded))


def _xml_text(argument: str | float | bool) -> str:
    """Return the text of a xacro argument."""
    return str(argument).lower() if isinstance(argument, bool) else str(argument)


def body_from_tree(spec: RobotSpec, tree: LinkTree) -> RobotBody:
    """Build the body of a robot from its links. All joints except wheel joints are at 0. Raises InvalidInput."""
    joints = select_wheels(tree, spec.drive)
    _check_wheels(spec, tree, joints)
    rolling = {link for wheel in joints for link in tree.subtree(wheel.joint.child)}
    fixed = [name for name in tree.links if name not in rolling]
    solids = [
        Solid(solid.shape, tree.poses[name].compose(solid.pose), name)
        for name in fixed
        for solid in tree.links[name].solids
    ]
    if not solids:
        raise InvalidInput([tree.element.problem("no link has a <collision>, so nothing of the robot can collide")])
    base_from_root = _base_from_root(joints, solids)
    hull = tuple(replace(solid, pose=base_from_root.compose(solid.pose)) for solid in solids)
    scale = _mass_scale(spec, tree)
    wheels = tuple(_build_wheel(tree, joint, base_from_root, scale, spec) for joint in joints)
    if wheels:
        hull = _without_casters(tree, hull)  # an omnidirectional base has no ground contact
    return assemble_body(spec, hull, wheels, _chassis_mass(tree, fixed, base_from_root, scale))


def _check_wheels(spec: RobotSpec, tree: LinkTree, wheels: list[WheelJoint]) -> None:
    if isinstance(spec.drive, Omnidirectional):
        return
    if isinstance(spec.drive, Mecanum):
        _check_corners(tree, wheels)
    driven = [wheel for wheel in wheels if not wheel.is_steered]
    if len({wheel.is_left for wheel in driven}) < 2:
        hint = "name the wheel joints in the drive's `left` and `right`"
        message = f"no driven wheels found on both sides: {_describe_wheels(*examine_joints(tree))}"
        raise InvalidInput([tree.element.problem(message, hint)])
    if spec.drive.type == "ackermann" and not any(wheel.is_steered for wheel in wheels):
        hint = "name the steering joints in the drive's `steering`"
        raise InvalidInput([tree.element.problem("no steered wheels found", hint)])
    _check_front_steering(wheels)


def _check_corners(tree: LinkTree, wheels: list[WheelJoint]) -> None:
    """Raise InvalidInput unless there are four wheels, one at each corner."""
    middle = np.mean([wheel.center[:2] for wheel in wheels], axis=0) if wheels else (0.0, 0.0)
    corners = {(wheel.center[0] > middle[0], wheel.center[1] > middle[1]) for wheel in wheels}
    if len(wheels) != 4 or len(corners) != 4:
        names = ", ".join(wheel.joint.name for wheel in wheels) or "none"
        message = f"a mecanum drive has one wheel at each of four corners; found: {names[:200]}"
        hint = "name the four wheel joints in the drive's `left` and `right`"
        raise InvalidInput([tree.element.problem(message, hint)])


def _check_front_steering(wheels: Sequence[WheelJoint]) -> None:
    """Raise InvalidInput if the steered wheels are not in front of the other wheels."""
    steered = [wheel for wheel in wheels if wheel.is_steered]
    if not steered:
        return
    front, rear = (
        float(np.mean([w.center[0] for w in group])) for group in (steered, [w for w in wheels if not w.is_steered])
    )
    if front <= rear:
        message = (
            f"its steered wheels are {rear - front:.3g} m behind the driven ones: only front steering is simulated"
        )
        hint = "x must point ahead: rotate the root's joint by 180 degrees if the URDF faces backwards"
        raise InvalidInput([steered[0].joint.element.problem(message, hint)])


def _base_from_root(wheels: list[WheelJoint], solids: Sequence[Solid]) -> Pose3:
    """Return the pose of the root frame in the base frame: on the ground below the center of the driven axles."""
    if not wheels:
        return Pose3(0.0, 0.0, -min(_lowest_z(solid) for solid in solids))
    x, y, _ = np.mean([wheel.center for wheel in wheels if not wheel.is_steered], axis=0).tolist()
    return Pose3(-x, -y, -min(wheel.bottom for wheel in wheels))


def _lowest_z(solid: Solid) -> float:
    return float(solid.pose.apply(hull_points(solid.shape))[:, 2].min())


def _mass_scale(spec: RobotSpec, tree: LinkTree) -> float:
    """Return the factor that makes the sum of all masses equal to the specified mass; 1 if no mass is specified."""
    total = sum(link.mass.mass for link in tree.links.values() if link.mass is not None)
    if total <= 0:
        raise InvalidInput([tree.element.problem("no link has a mass", "give its <inertial> a <mass>")])
    return spec.mass / total if spec.mass is not None else 1.0


def _chassis_mass(tree: LinkTree, links: Sequence[str], base_from_root: Pose3, scale: float) -> MassProperties:
    masses = [(tree.poses[name], tree.links[name].mass) for name in links]
    parts = [
        mass.transformed(base_from_root.compose(pose)) for pose, mass in masses if mass is not None and mass.mass > 0
    ]
    if not parts:
        raise InvalidInput([tree.element.problem("no link besides the wheels has a mass; give one an <inertial>")])
    whole = combine(parts)
    return MassProperties(whole.mass * scale, whole.center, whole.tensor * scale)


def _build_wheel(tree: LinkTree, wheel: WheelJoint, base_from_root: Pose3, scale: float, spec: RobotSpec) -> Wheel:
    x, y, _ = base_from_root.compose(Pose3(*wheel.center)).position
    links = [(tree.poses[name], tree.links[name].mass) for name in tree.subtree(wheel.joint.child)]
    parts = [mass.transformed(pose) for pose, mass in links if mass is not None and mass.mass > 0]
    mass = scale * sum(part.mass for part in parts)
    inertia = wheel_inertia(mass, wheel.radius, wheel.width) if mass > 0 else None
    if inertia is None:
        problem = wheel.joint.element.problem(f"the wheel on joint {wheel.joint.name!r} has no mass")
        raise InvalidInput([problem])
    car = spec.drive.type == "ackermann"
    return Wheel(
        wheel.joint.name, x, y, wheel.radius, wheel.width, inertia, is_driven=not (car and wheel.is_steered),
        is_steered=car and wheel.is_steered,
    )  # fmt: skip


def _without_casters(tree: LinkTree, hull: tuple[Solid, ...]) -> tuple[Solid, ...]:
    """Return the hull without casters: small parts that touch the ground.

    Raises InvalidInput if a large part touches the ground.
    """
    points = [solid.pose.apply(hull_points(solid.shape)) for solid in hull]
    whole = np.ptp(np.concatenate(points)[:, :2], axis=0)
    kept = []
    for solid, corners in zip(hull, points, strict=True):
        if corners[:, 2].min() >= MIN_GROUND_CLEARANCE_M:
            kept.append(solid)
        elif (np.ptp(corners[:, :2], axis=0) > MAX_CASTER_SIZE_RATIO * whole).any():
            depth = MIN_GROUND_CLEARANCE_M - corners[:, 2].min()
            message = f"link {solid.name!r} reaches {depth:.3f} m too low: it would drag over the ground"
            hint = "its wheels' collision shapes must reach lower than everything else"
            raise InvalidInput([tree.links[solid.name].element.problem(message, hint)])
    return tuple(kept)
