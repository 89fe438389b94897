"""Finds the wheels and the steering joints of a URDF, and warns about misaligned ones."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from simscen.core.errors import InvalidInput, Problem
from simscen.core.geometry import Pose3
from simscen.core.geometry.shapes import Cylinder, Mesh, Solid, Sphere
from simscen.model.robot import Ackermann, Differential, Drive, Omnidirectional
from simscen.sim.body.outline import hull_points
from simscen.sim.urdf.elements import Joint, LinkTree

MIN_AXIS_COSINE = 0.99
"""Cosine of the largest angle (8 degrees) between a joint axis and the direction that it is compared with."""

STEERING_JOINT_TYPES = ("revolute", "continuous")
"""Types of joints that can steer; a vertical prismatic joint is a suspension."""
ROUNDNESS_TOLERANCE = 0.05
"""Largest difference of the extents of a round mesh, and of its center from its axis, relative to the radius."""
MIN_CASTER_TRAIL_RADII = 0.1
"""Smallest distance along x, in wheel radii, of a caster's wheel from its swivel axis; a steered wheel has none."""


@dataclass(frozen=True, eq=False)
class WheelJoint:
    """A wheel in the root frame: the `place` of its center, `radius`, and `width` in meters.

    `trail` is its distance in m along x from the axis of its steering joint.
    """

    joint: Joint
    place: tuple[float, float, float]
    radius: float
    width: float
    steered: bool
    trail: float = 0.0

    @property
    def is_caster(self) -> bool:
        """Whether the wheel follows the motion of the robot instead of being steered."""
        return self.steered and self.trail > MIN_CASTER_TRAIL_RADII * self.radius


def infer_wheels(tree: LinkTree) -> list[WheelJoint]:
    """Return the wheels in a URDF: continuous joints with a lateral axis and a round link."""
    joints = tree.joints.values()
    steering_joints = [
        joint for joint in joints if joint.type in STEERING_JOINT_TYPES and _has_axis_along(tree, joint, 2)
    ]
    steered = steered_links(tree, steering_joints)
    wheels = [
        _with_trail(tree, wheel, steering_joints)
        for joint in joints
        if joint.type == "continuous"
        and _has_axis_along(tree, joint, 1)
        and (wheel := wheel_joint(tree, joint, joint.child in steered)) is not None
    ]
    return sorted(wheels, key=lambda w: (w.place[0], -w.place[1], w.joint.name))


def _with_trail(tree: LinkTree, wheel: WheelJoint, steering_joints: Sequence[Joint]) -> WheelJoint:
    """Return a wheel with its distance along x from the axis of its steering joint."""
    for joint in steering_joints:
        if wheel.joint.child in tree.subtree(joint.child):
            return replace(wheel, trail=abs(wheel.place[0] - tree.poses[joint.child].x))
    return wheel


def select_wheels(tree: LinkTree, drive: Drive) -> list[WheelJoint]:
    """Return the wheels of a drive: those in its specification, or the inferred ones. Raises InvalidInput."""
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
    wheels = infer_wheels(tree)
    if not named:
        # A wheel that swivels is a caster of a differential drive, not a steered wheel: it becomes part of the hull.
        return [w for w in wheels if not w.steered] if isinstance(drive, Differential) else wheels
    turned = steered_links(tree, [tree.joints[name] for name in steering or []])
    given = [
        WheelJoint(
            joint, tree.poses[joint.child].position, drive.wheel_radius, drive.wheel_width, joint.child in turned
        )
        if (inferred := wheel_joint(tree, joint, joint.child in turned)) is None
        else inferred
        for joint in (tree.joints[name] for name in (*(drive.left or []), *(drive.right or [])))
    ]
    rolling = {wheel.joint.name for wheel in given}
    return given + [w for w in wheels if w.joint.name not in rolling and w.joint.child in turned]


def steered_links(tree: LinkTree, knuckles: Sequence[Joint]) -> set[str]:
    """Return the names of all links below the steering joints."""
    return {link for joint in knuckles for link in tree.subtree(joint.child)}


def wheel_joint(tree: LinkTree, joint: Joint, steered: bool) -> WheelJoint | None:
    """Return the wheel on a joint by its collision shape, or None if that is not round."""
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
    """Return center (in the frame of the joint), radius, and width of a mesh in m; None if it is not round.

    The extents in eight directions across the axis of the joint must be equal.
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


def _has_axis_along(tree: LinkTree, joint: Joint, direction: int) -> bool:
    """Return whether a joint axis is parallel to the x, y, or z axis (0, 1, 2) of the root frame."""
    rotation = tree.poses[joint.child]._replace(x=0.0, y=0.0, z=0.0)
    axis = rotation.compose(Pose3(*joint.axis)).position
    return abs(axis[direction]) >= MIN_AXIS_COSINE


CODE = "SC405"
HEIGHT_TOLERANCE_M = 0.0005
"""Largest difference in m between the heights of parts that stand on the ground."""
MAX_CASTER_GAP_M = 0.003
"""Largest gap in m below a caster; the robot then stands on another caster, or tilts slightly."""
MAX_CASTER_HEIGHT_M = 0.02
"""Height in m above the ground below which a small link is meant to be a caster."""
MAX_CASTER_SIZE_M = 0.1
"""Largest length and width of a caster in m."""


def alignment_warnings(tree: LinkTree, drive: Drive) -> list[Problem]:
    """Return warnings about wheels at different heights, and about casters that are too low or too high."""
    wheels = select_wheels(tree, drive)
    if not wheels:
        return []
    ground = min(wheel.place[2] - wheel.radius for wheel in wheels)
    found = [*_wheel_warnings(wheels, ground), *_caster_warnings(tree, wheels, ground, drive.type == "differential")]
    return [Problem(p.path, p.line, p.col, CODE, p.message, p.hint, "warning", p.source) for p in found]


def _wheel_warnings(wheels: list[WheelJoint], ground: float) -> Iterator[Problem]:
    for wheel in wheels:
        gap = wheel.place[2] - wheel.radius - ground
        if gap > HEIGHT_TOLERANCE_M:
            message = f"the wheel on joint {wheel.joint.name!r} is {1e3 * gap:.1f} mm higher than the lowest wheel"
            yield wheel.joint.element.problem(message, "simscen places all wheels on the ground")


def _caster_warnings(tree: LinkTree, wheels: list[WheelJoint], ground: float, needs_caster: bool) -> Iterator[Problem]:
    rolling = {link for wheel in wheels for link in tree.subtree(wheel.joint.child)}
    gaps = {
        name: _lowest(tree, name) - ground for name in tree.links if name not in rolling and tree.links[name].solids
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


def _points(tree: LinkTree, name: str) -> "np.ndarray[tuple[int, int], np.dtype[np.float64]]":
    pose = tree.poses[name]
    return np.concatenate([pose.compose(s.pose).apply(hull_points(s.shape)) for s in tree.links[name].solids])


def _lowest(tree: LinkTree, name: str) -> float:
    return float(_points(tree, name)[:, 2].min())


def _is_small(tree: LinkTree, name: str) -> bool:
    return bool((np.ptp(_points(tree, name)[:, :2], axis=0) <= MAX_CASTER_SIZE_M).all())
