"""Infers the specification of a robot that has only a URDF: its drive, limits, and sensors."""

import math
from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
from pydantic import ValidationError

from simscen.assets.folders import AllowedFolders
from simscen.core.errors import InvalidInput
from simscen.model.robot import Ackermann, Differential, Limits, RobotSpec, SkidSteer
from simscen.model.sensors import InertialUnit, Lidar, Mount, Sensor, WheelOdometry
from simscen.sim.body.robot_body import hull_height
from simscen.sim.urdf.body import body_from_tree, read_tree
from simscen.sim.urdf.elements import MeshReader
from simscen.sim.urdf.link_tree import LinkTree
from simscen.sim.urdf.wheels import WheelJoint, check_front_steering, describe_wheels, examine_joints

AXLE_TOLERANCE_M = 0.02
"""Largest distance in m along x between wheels on the same axle."""
MAX_UPSIDE_DOWN_Z = -0.9
"""A lidar is mounted upside down if the z component of its z axis is at most this value."""
DEFAULT_MAX_STEERING_RAD = 0.5
"""Largest steering angle of a car whose steering joints have no limits below 90 degrees."""
MIN_STEERING_RAD, MAX_STEERING_RAD = 0.1, 1.0
"""Range to which the limit of a steering joint is clipped."""
LIDAR_NAMES = ("laser", "lidar", "scan")
"""A link carries a lidar if its name contains one of these words."""
LIDAR_GAP_M = 0.02
"""Height of a lidar above the hull, if no link carries a lidar."""
ROBOT_FILE_HINT = "write a *.robot.yaml next to it with its drive, limits, and sensors; see `simscen explain robot`"

InferredDrive = Ackermann | Differential | SkidSteer
"""Drives that `infer_robot_spec` can infer."""


def infer_robot_spec(path: Path, roots: Sequence[Path] = (), read_mesh: MeshReader | None = None) -> RobotSpec:
    """Infer the specification of a robot from its URDF: the drive, its limits, and a lidar, odometry, and an IMU.

    A robot with steered wheels has an Ackermann drive, a robot with a single axle has a differential drive, and any
    other robot has a skid-steer drive. Speed limits are 1 m/s and 1.5 rad/s, or lower if the wheel joints are slower or
    far apart; acceleration limits are 1 m/s² and 2 rad/s². The lidar is at the first link whose name contains one of
    LIDAR_NAMES, or on top of the robot. All files must be in `roots` (default: the folder of `path`). Raises
    InvalidInput if the file is invalid or the drive cannot be inferred.
    """
    folders = AllowedFolders.of(roots or (path.resolve().parent,))
    tree = read_tree(path, folders, read_mesh)
    try:
        return _infer_from_tree(tree, path)
    except ValidationError as error:
        problem = error.errors()[0]
        message = f"the robot cannot be inferred, because its `{problem['loc'][-1]}` is not valid: {problem['msg']}"
        raise InvalidInput([tree.element.problem(message, ROBOT_FILE_HINT)]) from error


def _infer_from_tree(tree: LinkTree, path: Path) -> RobotSpec:
    """Infer the specification from the links and joints; raises InvalidInput, or ValidationError for invalid values."""
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


def _infer_drive(tree: LinkTree, wheels: list[WheelJoint], others: Mapping[str, list[str]]) -> InferredDrive:
    """Return the drive with these wheels; raises InvalidInput. `wheels` and `others` are from `examine_joints`."""
    driven = [wheel for wheel in wheels if not wheel.is_steered]
    left, right = ([w for w in driven if w.is_left is side] for side in (True, False))
    if not left or len(left) != len(right):
        message = f"the drive of the robot cannot be inferred from its wheels: {describe_wheels(wheels, others)}"
        raise InvalidInput([tree.element.problem(message, ROBOT_FILE_HINT)])
    separation = float(np.mean([w.center[1] for w in left]) - np.mean([w.center[1] for w in right]))
    wheel_positions = [w.center[0] for w in driven]
    radius, width = (float(np.mean(values)) for values in zip(*((w.radius, w.width) for w in driven), strict=True))
    size = {"wheel_radius": radius, "wheel_separation": separation, "wheel_width": width}
    steered = [wheel for wheel in wheels if wheel.is_steered and not wheel.is_caster]
    if steered:
        check_front_steering([*driven, *steered])
        base = float(np.mean([wheel.center[0] for wheel in steered]) - np.mean(wheel_positions))
        steering = _max_steering(steered, max(abs(wheel.center[1]) for wheel in steered) / base)
        return Ackermann.model_validate({"type": "ackermann", "wheel_base": base, "max_steering": steering, **size})
    if max(wheel_positions) - min(wheel_positions) < AXLE_TOLERANCE_M:
        return Differential.model_validate({"type": "differential", **size})
    base = max(wheel_positions) - min(wheel_positions)
    scale = min(10.0, 1 + _skid_factor(wheel_positions) * (base / separation) ** 2)
    return SkidSteer.model_validate({"type": "skid_steer", "wheel_base": base, "turning_scale": scale, **size})


def _skid_factor(wheel_positions: Sequence[float]) -> float:
    """Return the factor k of turning_scale = 1 + k (wheel base / wheel separation)², for wheels at these x in m.

    The factors for two, three, and more axles were measured with `simscen robot check`.
    """
    gaps = sum(after - before > AXLE_TOLERANCE_M for before, after in pairwise(sorted(wheel_positions)))
    return {1: 1.2, 2: 0.1}.get(gaps, 0.3)


def _max_steering(wheels: list[WheelJoint], ratio: float) -> float:
    """Return the largest steering angle in rad of the bicycle model, from the limits of the steering joints.

    `ratio` is the lateral distance of the steered wheels from the middle, divided by the wheel base. cot(bicycle angle)
    = cot(angle of the inner wheel) + ratio.
    """
    ranges = [min(-wheel.steering.limits.lower, wheel.steering.limits.upper) for wheel in wheels if wheel.steering]
    limits = [angle for angle in ranges if 0 < angle < math.pi / 2]
    if not limits:
        return DEFAULT_MAX_STEERING_RAD
    tangent = math.tan(max(MIN_STEERING_RAD, min(MAX_STEERING_RAD, *limits)))
    return math.atan(tangent / (1 + tangent * ratio))


def _infer_limits(wheels: list[WheelJoint], drive: InferredDrive) -> Limits:
    speeds = [wheel.joint.limits.velocity * wheel.radius for wheel in wheels if not wheel.is_steered]
    linear = min([1.0, *(speed for speed in speeds if speed > 0)])
    angular = min(1.5, 2 * linear / drive.wheel_separation)
    return Limits(linear=linear, angular=angular, linear_acceleration=1.0, angular_acceleration=2.0)


def _infer_lidar_mount(tree: LinkTree, draft: RobotSpec, wheels: list[WheelJoint]) -> Mount:
    ground = min(wheel.bottom for wheel in wheels)
    axle = np.mean([wheel.center for wheel in wheels if not wheel.is_steered], axis=0)
    for name in tree.links:
        if any(word in name.lower() for word in LIDAR_NAMES):
            pose = tree.poses[name]
            x, y, z = float(pose.x - axle[0]), float(pose.y - axle[1]), float(pose.z - ground)
            roll = math.pi if pose.rotation()[2, 2] < MAX_UPSIDE_DOWN_Z else 0.0
            return Mount(x=x, y=y, z=max(0.0, z), roll=roll, yaw=pose.yaw)
    return Mount(z=hull_height(body_from_tree(draft, tree)) + LIDAR_GAP_M)
