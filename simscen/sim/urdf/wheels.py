"""Finds the wheels and steering joints of a URDF."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from simscen.core.errors import InvalidInput
from simscen.core.geometry import Pose3
from simscen.core.geometry.shapes import Cylinder, Mesh, Solid, Sphere
from simscen.model.robot import Ackermann, Differential, Drive, Omnidirectional
from simscen.sim.body.outline import hull_points
from simscen.sim.urdf.elements import Joint
from simscen.sim.urdf.link_tree import LinkTree

MIN_AXIS_COSINE = 0.99
"""Smallest cosine of the angle between two axes that count as parallel (8 degrees)."""
ROTARY_JOINT_TYPES = ("revolute", "continuous")
"""Types of joints that can steer or turn a wheel."""
ROUNDNESS_TOLERANCE = 0.05
"""Largest deviation of the radius of a round mesh, and largest offset from its axis, divided by the radius."""
MIN_CASTER_TRAIL_RADII = 0.1
"""Smallest trail of a caster in wheel radii: the distance along x between the wheel center and the swivel axis."""
MIN_WHEEL_RANGE_RAD = 20 * math.pi
"""Smallest range of a revolute joint that counts as continuous: ten turns."""
MAX_WHEEL_GAP_RADII = 0.25
"""Largest gap below a wheel that counts as standing on the ground, in wheel radii."""
MIN_DRIVEN_RADIUS_RATIO = 0.75
"""Smallest radius of a driven wheel, divided by the radius of the largest driven wheel."""
MAX_LISTED_NAMES = 4
"""Maximum number of names, and of reasons, in a message."""


@dataclass(frozen=True, eq=False)
class WheelJoint:
    """A wheel with its `center` in the root frame. Lengths are in m.

    `joint` is the joint about which the wheel rolls. `steering` is the steering joint of the wheel, or None. `trail` is
    the distance along x between the wheel's center and the steering axis. A wheel that swivels freely counts as
    steered, too.
    """

    joint: Joint
    center: tuple[float, float, float]
    radius: float
    width: float
    is_steered: bool
    trail: float = 0.0
    steering: Joint | None = None

    @property
    def bottom(self) -> float:
        """Height in m of the lowest point of the wheel in the root frame."""
        return self.center[2] - self.radius

    @property
    def is_left(self) -> bool:
        """Whether the wheel is on the left side."""
        return self.center[1] > 0

    @property
    def is_caster(self) -> bool:
        """Whether the wheel swivels freely instead of being steered."""
        return self.is_steered and self.trail > MIN_CASTER_TRAIL_RADII * self.radius


def examine_joints(tree: LinkTree) -> tuple[list[WheelJoint], Mapping[str, list[str]]]:
    """Return the wheels in a URDF, and the names of all other movable joints, by the reason why a joint has no wheel.

    A wheel is a round link that stands on the ground and turns without limits about the y axis.
    """
    joints = [joint for joint in tree.joints.values() if joint.type != "fixed"]
    steering_joints = [
        joint for joint in joints if joint.type in ROTARY_JOINT_TYPES and _parallel_axis(tree, joint) == "z"
    ]
    steered = _steered_links(tree, steering_joints)
    wheels: list[WheelJoint] = []
    others: dict[str, list[str]] = {}
    for joint in joints:
        wheel = _measure_wheel(tree, joint, joint.child in steered)
        if reason := _reason_for_no_wheel(tree, joint, wheel):
            others.setdefault(reason, []).append(joint.name)
        elif wheel is not None:
            wheels.append(_with_steering(tree, wheel, steering_joints))
    ground = min((wheel.bottom for wheel in wheels), default=0.0)
    largest = max(
        (wheel.radius for wheel in wheels if not wheel.is_steered and _stands_on_ground(wheel, ground)), default=0.0
    )
    kept = []
    for wheel in sorted(wheels, key=lambda w: (w.center[0], -w.center[1], w.joint.name)):
        if not _stands_on_ground(wheel, ground):
            others.setdefault(f"{wheel.bottom - ground:.3g} m above the ground", []).append(wheel.joint.name)
        elif not wheel.is_steered and wheel.radius < MIN_DRIVEN_RADIUS_RATIO * largest:
            reason = f"radius {wheel.radius:.3g} m, much less than that of the largest wheel"
            others.setdefault(reason, []).append(wheel.joint.name)
        else:
            kept.append(wheel)
    return kept, others


def _stands_on_ground(wheel: WheelJoint, ground: float) -> bool:
    """Return whether a wheel stands on the ground at the height `ground` m in the root frame."""
    return wheel.bottom - ground <= MAX_WHEEL_GAP_RADII * wheel.radius


def _reason_for_no_wheel(tree: LinkTree, joint: Joint, wheel: WheelJoint | None) -> str:
    """Return the reason why a joint has no wheel, or "" for a wheel. `wheel` is the result of `_measure_wheel`."""
    if joint.type not in ROTARY_JOINT_TYPES:
        return f"{joint.type} joint"
    if joint.limits.upper - joint.limits.lower < MIN_WHEEL_RANGE_RAD:
        return f"{joint.type} joint with limits"
    axis = _parallel_axis(tree, joint)
    if axis != "y":
        return f"axis along {axis}, not y" if axis else "axis not along y"
    if wheel is not None:
        return ""
    return "no round collision shape" if tree.links[joint.child].solids else "no collision shape"


def _with_steering(tree: LinkTree, wheel: WheelJoint, steering_joints: Sequence[Joint]) -> WheelJoint:
    """Return a wheel with its steering joint and trail, or the same wheel if it has no steering joint."""
    for joint in steering_joints:
        if wheel.joint.child in tree.subtree(joint.child):
            return replace(wheel, trail=abs(wheel.center[0] - tree.poses[joint.child].x), steering=joint)
    return wheel


def select_wheels(tree: LinkTree, drive: Drive) -> list[WheelJoint]:
    """Return the wheels on the joints that the drive names. Without names, find the wheels. Raises InvalidInput.

    The left wheels, the right wheels, and the steered wheels of a car can be named independently. An omnidirectional
    drive has no wheels.
    """
    if isinstance(drive, Omnidirectional):
        return []
    steering = drive.steering if isinstance(drive, Ackermann) else None
    sides = drive.left, drive.right
    named = [name for names in (*sides, steering) for name in names or []]
    unknown = [name for name in named if name not in tree.joints]
    if unknown:
        problem = tree.element.problem(
            f"no joint called {unknown[0]!r}", f"joints: {', '.join(sorted(tree.joints))[:300]}"
        )
        raise InvalidInput([problem])
    wheels, _ = examine_joints(tree)
    if not named:
        # A wheel that swivels is a caster of a differential drive, not a steered wheel: it becomes part of the hull.
        return [w for w in wheels if not w.is_steered] if isinstance(drive, Differential) else wheels
    if steering is None and isinstance(drive, Ackermann):
        steered_links = {wheel.joint.child for wheel in wheels if wheel.is_steered}
    else:
        steered_links = _steered_links(tree, [tree.joints[name] for name in steering or []])
    others = [w for w in wheels if not (w.is_steered or w.joint.child in steered_links or w.joint.name in named)]
    selected = []
    for names, is_left in zip(sides, (True, False), strict=True):
        if names is None:
            selected += [wheel for wheel in others if wheel.is_left is is_left]
        for joint in (tree.joints[name] for name in names or []):
            is_steered, center = joint.child in steered_links, tree.poses[joint.child].position
            specified = WheelJoint(joint, center, drive.wheel_radius, drive.wheel_width, is_steered)
            selected.append(_measure_wheel(tree, joint, is_steered) or specified)
    return selected + [w for w in wheels if w.joint.name not in named and w.joint.child in steered_links]


def _steered_links(tree: LinkTree, steering_joints: Sequence[Joint]) -> set[str]:
    """Return the names of all links that the steering joints turn."""
    return {link for joint in steering_joints for link in tree.subtree(joint.child)}


def _measure_wheel(tree: LinkTree, joint: Joint, is_steered: bool) -> WheelJoint | None:
    """Return the wheel on a joint, with the size of its first round collision shape, or None if no shape is round."""
    for solid in tree.links[joint.child].solids:
        center = tree.poses[joint.child].compose(solid.pose).position
        match solid.shape:
            case Cylinder(radius, length):
                return WheelJoint(joint, center, radius, length, is_steered)
            case Sphere(radius):
                return WheelJoint(joint, center, radius, radius / 2, is_steered)
            case Mesh() if (mesh := _round_mesh(joint, solid)) is not None:
                mesh_center, radius, width = mesh
                center = tree.poses[joint.child].compose(mesh_center).position
                return WheelJoint(joint, center, radius, width, is_steered)
            case _:
                continue
    return None


def _round_mesh(joint: Joint, solid: Solid) -> tuple[Pose3, float, float] | None:
    """Return the center in the child link's frame, the radius, and the width of a round mesh in m, or None.

    A mesh is round if its extents in eight directions perpendicular to the joint axis are equal.
    """
    axis = np.array(joint.axis) / np.linalg.norm(joint.axis)
    across = np.linalg.svd(axis[None])[2][1:]  # two unit vectors (2, 3) perpendicular to the axis
    points = solid.pose.apply(hull_points(solid.shape))
    angles = np.arange(8) * (np.pi / 8)
    extents = (points @ across.T) @ np.array([np.cos(angles), np.sin(angles)])  # (n, 8)
    radii, offsets = np.ptp(extents, axis=0) / 2, (extents.max(axis=0) + extents.min(axis=0)) / 2
    radius = float(radii.mean())
    if np.ptp(radii) > ROUNDNESS_TOLERANCE * radius or np.abs(offsets).max() > ROUNDNESS_TOLERANCE * radius:
        return None
    along = points @ axis
    x, y, z = (axis * (along.max() + along.min()) / 2).tolist()
    return Pose3(x, y, z), radius, float(np.ptp(along))


def _parallel_axis(tree: LinkTree, joint: Joint) -> str:
    """Return the axis of the root frame that is parallel to a joint axis: "x", "y", "z", or "" for no axis."""
    rotation = tree.poses[joint.child]._replace(x=0.0, y=0.0, z=0.0)
    direction = rotation.compose(Pose3(*joint.axis)).position
    return "".join(name for name, cosine in zip("xyz", direction, strict=True) if abs(cosine) >= MIN_AXIS_COSINE)


def check_front_steering(wheels: Sequence[WheelJoint]) -> None:
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


def describe_wheels(wheels: list[WheelJoint], others: Mapping[str, list[str]]) -> str:
    """Return a message with the names of all wheels, and the reasons why the other movable joints are not wheels."""
    if not wheels and not others:
        return "the URDF has no movable joints"
    groups: dict[str, list[str]] = {"left": [], "right": []}
    for wheel in wheels:
        group = "steered" if wheel.is_steered else "left" if wheel.is_left else "right"
        groups.setdefault(group, []).append(wheel.joint.name)
    found = [f"{group}: {_shortened(names)}" for group, names in groups.items()]
    reasons = [f"{_shortened(names)} ({reason})" for reason, names in others.items()][:MAX_LISTED_NAMES]
    return "; ".join(found + ([f"not wheels: {', '.join(reasons)}"] if reasons else []))


def _shortened(names: Sequence[str]) -> str:
    """Return a list of at most MAX_LISTED_NAMES names for a message."""
    more = f" and {len(names) - MAX_LISTED_NAMES} more" if len(names) > MAX_LISTED_NAMES else ""
    return ", ".join(names[:MAX_LISTED_NAMES]) + more if names else "none"
