"""Finds the wheels and steering joints of a URDF, and warns about wheels and casters at wrong heights."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from simscen.core.errors import InvalidInput, Problem
from simscen.core.geometry import Pose3
from simscen.core.geometry.shapes import Cylinder, Mesh, Solid, Sphere
from simscen.model.robot import Ackermann, Differential, Drive, Omnidirectional
from simscen.sim.body.outline import hull_points
from simscen.sim.urdf.elements import Joint, LinkTree

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


@dataclass(frozen=True, eq=False)
class WheelJoint:
    """A wheel with its `center` in the root frame. Lengths are in m.

    `joint` is the joint about which it rolls. `steering` is its steering joint (None: not steered), and `trail` the
    distance along x between its center and the steering axis.
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
    """Return the wheels in a URDF, and the names of all other movable joints by the reason why they are not wheels.

    A wheel is a joint about the y axis with a round child link that stands on the ground.
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
    largest = max((wheel.radius for wheel in wheels if not wheel.is_steered and _stands_on(ground, wheel)), default=0.0)
    kept = []
    for wheel in sorted(wheels, key=lambda w: (w.center[0], -w.center[1], w.joint.name)):
        if not _stands_on(ground, wheel):
            others.setdefault(f"{wheel.bottom - ground:.3g} m above the ground", []).append(wheel.joint.name)
        elif not wheel.is_steered and wheel.radius < MIN_DRIVEN_RADIUS_RATIO * largest:
            reason = f"radius {wheel.radius:.3g} m, much less than that of the largest wheel"
            others.setdefault(reason, []).append(wheel.joint.name)
        else:
            kept.append(wheel)
    return kept, others


def _stands_on(ground: float, wheel: WheelJoint) -> bool:
    return wheel.bottom - ground <= MAX_WHEEL_GAP_RADII * wheel.radius


def _reason_for_no_wheel(tree: LinkTree, joint: Joint, wheel: WheelJoint | None) -> str:
    """Return the reason why a joint has no wheel, or "" if it has one. `wheel` is the result of `_measure_wheel`."""
    if not _turns_freely(joint):
        return f"{joint.type} joint with limits" if joint.type == "revolute" else f"{joint.type} joint"
    axis = _parallel_axis(tree, joint)
    if axis != "y":
        return f"axis along {axis}, not y" if axis else "axis not along y"
    if wheel is not None:
        return ""
    return "no round collision shape" if tree.links[joint.child].solids else "no collision shape"


def _turns_freely(joint: Joint) -> bool:
    """Return whether a joint is continuous, or revolute with a range of at least MIN_WHEEL_RANGE_RAD."""
    return joint.type in ROTARY_JOINT_TYPES and joint.limits.upper - joint.limits.lower >= MIN_WHEEL_RANGE_RAD


def _with_steering(tree: LinkTree, wheel: WheelJoint, steering_joints: Sequence[Joint]) -> WheelJoint:
    """Return a wheel with its steering joint and trail, or the same wheel if it has no steering joint."""
    for joint in steering_joints:
        if wheel.joint.child in tree.subtree(joint.child):
            return replace(wheel, trail=abs(wheel.center[0] - tree.poses[joint.child].x), steering=joint)
    return wheel


def select_wheels(tree: LinkTree, drive: Drive) -> list[WheelJoint]:
    """Return the wheels on the joints that the drive names, or else all wheels in the URDF. Raises InvalidInput."""
    if isinstance(drive, Omnidirectional):
        return []
    steering = drive.steering if isinstance(drive, Ackermann) else None
    named = [*(drive.left or []), *(drive.right or []), *(steering or [])]
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
    turned = _steered_links(tree, [tree.joints[name] for name in steering or []])
    given = [
        WheelJoint(
            joint, tree.poses[joint.child].position, drive.wheel_radius, drive.wheel_width, joint.child in turned
        )
        if (inferred := _measure_wheel(tree, joint, joint.child in turned)) is None
        else inferred
        for joint in (tree.joints[name] for name in (*(drive.left or []), *(drive.right or [])))
    ]
    rolling = {wheel.joint.name for wheel in given}
    return given + [w for w in wheels if w.joint.name not in rolling and w.joint.child in turned]


def _steered_links(tree: LinkTree, steering_joints: Sequence[Joint]) -> set[str]:
    """Return the names of all links below the steering joints."""
    return {link for joint in steering_joints for link in tree.subtree(joint.child)}


def _measure_wheel(tree: LinkTree, joint: Joint, steered: bool) -> WheelJoint | None:
    """Return the wheel on a joint, with the size of its first round collision shape, or None if no shape is round."""
    for solid in tree.links[joint.child].solids:
        place = tree.poses[joint.child].compose(solid.pose).position
        match solid.shape:
            case Cylinder(radius, length):
                return WheelJoint(joint, place, radius, length, steered)
            case Sphere(radius):
                return WheelJoint(joint, place, radius, radius / 2, steered)
            case Mesh() if (mesh := _round_mesh(joint, solid)) is not None:
                center, radius, width = mesh
                return WheelJoint(joint, tree.poses[joint.child].compose(center).position, radius, width, steered)
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
    """Return the axis of the root frame ("x", "y", or "z") that is parallel to a joint axis, or "" if none is."""
    rotation = tree.poses[joint.child]._replace(x=0.0, y=0.0, z=0.0)
    parts = rotation.compose(Pose3(*joint.axis)).position
    return "".join(name for name, part in zip("xyz", parts, strict=True) if abs(part) >= MIN_AXIS_COSINE)


ALIGNMENT_CODE = "SC405"
"""Code of all warnings about the heights of wheels and casters."""
HEIGHT_TOLERANCE_M = 0.0005
"""Largest difference in m between the heights of parts that stand on the ground."""
MAX_CASTER_GAP_M = 0.003
"""Largest gap in m below a caster without a warning."""
MAX_CASTER_HEIGHT_M = 0.02
"""Largest height in m above the ground of a small link that is probably meant to be a caster."""
MAX_CASTER_SIZE_M = 0.1
"""Largest length and width in m of a link that is probably meant to be a caster."""


def alignment_warnings(tree: LinkTree, drive: Drive) -> list[Problem]:
    """Return warnings about wheels at different heights, and about casters that are too low or too high."""
    wheels = select_wheels(tree, drive)
    if not wheels:
        return []
    ground = min(wheel.bottom for wheel in wheels)
    found = [*_wheel_warnings(wheels, ground), *_caster_warnings(tree, wheels, ground, drive.type == "differential")]
    return [Problem(p.path, p.line, p.col, ALIGNMENT_CODE, p.message, p.hint, "warning", p.source) for p in found]


def _wheel_warnings(wheels: list[WheelJoint], ground: float) -> Iterator[Problem]:
    for wheel in wheels:
        gap = wheel.bottom - ground
        if gap > HEIGHT_TOLERANCE_M:
            message = f"the wheel on joint {wheel.joint.name!r} is {1e3 * gap:.1f} mm higher than the lowest wheel"
            yield wheel.joint.element.problem(message, "simscen places all wheels on the ground")


def _caster_warnings(tree: LinkTree, wheels: list[WheelJoint], ground: float, needs_caster: bool) -> Iterator[Problem]:
    rolling = {link for wheel in wheels for link in tree.subtree(wheel.joint.child)}
    gaps = {
        name: _lowest_z(tree, name) - ground for name in tree.links if name not in rolling and tree.links[name].solids
    }
    for name, gap in gaps.items():
        if gap < -HEIGHT_TOLERANCE_M:
            message = (
                f"link {name!r} reaches {-1e3 * gap:.1f} mm below the wheels, which would lose contact with the ground"
            )
            hint = f"raise it by {-gap:.4g} m; simscen uses frictionless spheres as casters instead"
            yield tree.links[name].element.problem(message, hint)
    nearest = min(gaps, key=lambda name: gaps[name], default=None)
    if needs_caster and nearest and MAX_CASTER_GAP_M < gaps[nearest] < MAX_CASTER_HEIGHT_M and _is_small(tree, nearest):
        message = (
            f"link {nearest!r} is {1e3 * gaps[nearest]:.1f} mm above the ground, so that the robot would tip onto it"
        )
        hint = f"lower it by {gaps[nearest]:.4g} m; simscen uses spheres that touch the ground as casters instead"
        yield tree.links[nearest].element.problem(message, hint)


def _collision_points(tree: LinkTree, name: str) -> "np.ndarray[tuple[int, int], np.dtype[np.float64]]":
    pose = tree.poses[name]
    return np.concatenate([pose.compose(s.pose).apply(hull_points(s.shape)) for s in tree.links[name].solids])


def _lowest_z(tree: LinkTree, name: str) -> float:
    return float(_collision_points(tree, name)[:, 2].min())


def _is_small(tree: LinkTree, name: str) -> bool:
    return bool((np.ptp(_collision_points(tree, name)[:, :2], axis=0) <= MAX_CASTER_SIZE_M).all())
