"""Infers the specification of a robot from its URDF, if the URDF is unambiguous."""

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from simscen.assets.folders import AllowedFolders
from simscen.core.errors import InvalidInput
from simscen.model.robot import (
    Ackermann,
    Differential,
    Drive,
    InertialUnit,
    Lidar,
    Limits,
    Mount,
    RobotSpec,
    Sensor,
    SkidSteer,
    WheelOdometry,
)
from simscen.sim.body.outline import hull_points
from simscen.sim.urdf.body import body_from_tree, check_front_steering, read_tree
from simscen.sim.urdf.elements import MeshReader, Tree
from simscen.sim.urdf.wheels import WheelJoint, infer_wheels

AXLE_TOLERANCE_M = 0.02
"""Largest difference in m along x of wheels on the same axle."""
MAX_UPSIDE_DOWN_Z = -0.9
"""Largest z component, in the frame of the robot, of the z axis of a lidar that is mounted upside down."""
LIDAR_NAMES = ("laser", "lidar", "scan")
"""Words in the names of links that carry a lidar."""
HINT = "write a *.robot.yaml next to it with its drive, limits, and sensors; see `simscen explain robot`"


def infer_robot_spec(path: Path, roots: Sequence[Path] = (), read_mesh: MeshReader | None = None) -> RobotSpec:
    """Infer the specification of a robot from its URDF: drive from the wheels, and default lidar, odometry, and IMU.

    Two driven wheels make a differential drive, four or more a skid-steer drive, steered wheels a car. Limits are 1
    m/s, 1.5 rad/s, 1 m/s², and 2 rad/s², or those of the wheel joints if they are lower. The lidar is on the link named
    laser, lidar, or scan, or on top. Raises InvalidInput if the file is invalid or its drive ambiguous.
    """
    folders = AllowedFolders.of(roots or (path.resolve().parent,))
    tree = read_tree(path, folders, read_mesh)
    wheels = infer_wheels(tree)
    drive = _drive(tree, wheels)
    draft = RobotSpec(
        simscen=1,
        name=tree.name.lstrip("/") or path.stem,
        urdf=path.name,
        drive=drive,
        limits=_limits(wheels, drive),
        sensors={},
    )
    sensors = {
        "lidar": Sensor(lidar=Lidar(mount=_lidar_mount(tree, draft, wheels))),
        "odom": Sensor(odometry=WheelOdometry()),
        "imu": Sensor(imu=InertialUnit()),
    }
    return draft.model_copy(update={"sensors": sensors})


def _drive(tree: Tree, wheels: list[WheelJoint]) -> Drive:
    driven = [wheel for wheel in wheels if not wheel.steered]
    left, right = ([w for w in driven if (w.place[1] > 0) is side] for side in (True, False))
    if not left or len(left) != len(right):
        raise InvalidInput([tree.element.problem("the drive of the robot cannot be inferred from its wheels", HINT)])
    separation = float(np.mean([w.place[1] for w in left]) - np.mean([w.place[1] for w in right]))
    axles = [w.place[0] for w in driven]
    size = {"wheel_radius": driven[0].radius, "wheel_separation": separation, "wheel_width": driven[0].width}
    steered = [wheel.place[0] for wheel in wheels if wheel.steered and not wheel.is_caster]
    if steered:
        check_front_steering(wheels)
        base = float(np.mean(steered) - np.mean(axles))
        return Ackermann.model_validate({"type": "ackermann", "wheel_base": base, "max_steering": 0.5, **size})
    if max(axles) - min(axles) < AXLE_TOLERANCE_M:
        return Differential.model_validate({"type": "differential", **size})
    base = max(axles) - min(axles)
    # Coulomb friction at the corners of a rectangle: turning in place takes this much more than the kinematics say.
    scale = min(10.0, 1 + (base / separation) ** 2)
    return SkidSteer.model_validate({"type": "skid_steer", "wheel_base": base, "turning_scale": scale, **size})


def _limits(wheels: list[WheelJoint], drive: Drive) -> Limits:
    limits = [(wheel.joint.element.child("limit"), wheel.radius) for wheel in wheels if not wheel.steered]
    speeds = [limit.numbers("velocity", 1, (0.0,))[0] * radius for limit, radius in limits if limit is not None]
    linear = min([1.0, *(speed for speed in speeds if speed > 0)])
    angular = min(1.5, 2 * linear / getattr(drive, "wheel_separation", 1.0))
    return Limits(linear=linear, angular=angular, linear_acceleration=1.0, angular_acceleration=2.0)


def _lidar_mount(tree: Tree, draft: RobotSpec, wheels: list[WheelJoint]) -> Mount:
    body = body_from_tree(draft, tree)
    ground = min(wheel.place[2] - wheel.radius for wheel in wheels)
    axle = np.mean([wheel.place for wheel in wheels if not wheel.steered], axis=0)
    for name in tree.links:
        if any(word in name.lower() for word in LIDAR_NAMES):
            pose = tree.poses[name]
            x, y, z = float(pose.x - axle[0]), float(pose.y - axle[1]), float(pose.z - ground)
            roll = math.pi if pose.rotation()[2, 2] < MAX_UPSIDE_DOWN_Z else 0.0
            return Mount(x=x, y=y, z=max(0.0, z), roll=roll, yaw=pose.yaw)
    top = max(float(solid.pose.apply(hull_points(solid.shape))[:, 2].max()) for solid in body.hull)
    return Mount(z=top + 0.02)
