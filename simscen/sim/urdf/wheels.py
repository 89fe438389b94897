"""Which joints of a URDF are wheels, and which steer."""

from collections.abc import Sequence
from dataclasses import dataclass

from simscen.core.errors import InvalidInput
from simscen.core.geometry import Pose3
from simscen.core.geometry.shapes import Cylinder, Sphere
from simscen.model.robot import Ackermann, Differential, Drive, Omnidirectional
from simscen.sim.urdf.elements import Joint
from simscen.sim.urdf.tree import Tree

ALONG = 0.99
"""Cosine within which an axis counts as pointing sideways or up (8 degrees)."""

TURNING = ("revolute", "continuous")
"""Joints that can steer; an upright prismatic one is a suspension."""


@dataclass(frozen=True, eq=False)
class WheelJoint:
    """A wheel in the frame of the root: the `place` of its middle, `radius` and `width` in meters."""

    joint: Joint
    place: tuple[float, float, float]
    radius: float
    width: float
    steered: bool


def infer_wheels(tree: Tree) -> list[WheelJoint]:
    """The wheels that the URDF makes plain: continuous joints about a sideways axis that carry something round."""
    steering = steered_links(tree, [j for j in tree.joints.values() if j.type in TURNING and _about(tree, j, 2)])
    wheels = [
        wheel_joint(tree, joint, joint.child in steering)
        for joint in tree.joints.values()
        if joint.type == "continuous" and _about(tree, joint, 1)
    ]
    return sorted((w for w in wheels if w is not None), key=lambda w: (w.place[0], -w.place[1], w.joint.name))


def select_wheels(tree: Tree, drive: Drive) -> list[WheelJoint]:
    """The wheels of a drive: those that its specification names, or those that are found. Raises InvalidInput."""
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
        if (round_one := wheel_joint(tree, joint, joint.child in turned)) is None
        else round_one
        for joint in (tree.joints[name] for name in (*(drive.left or []), *(drive.right or [])))
    ]
    rolling = {wheel.joint.name for wheel in given}
    return given + [w for w in wheels if w.joint.name not in rolling and w.joint.child in turned]


def steered_links(tree: Tree, knuckles: Sequence[Joint]) -> set[str]:
    """Everything that hangs on these joints."""
    return {link for joint in knuckles for link in tree.subtree(joint.child)}


def wheel_joint(tree: Tree, joint: Joint, steered: bool) -> WheelJoint | None:
    """The wheel on a joint by its collision shape; None when that is not round."""
    for solid in tree.links[joint.child].solids:
        place = tree.poses[joint.child].compose(solid.pose).position
        match solid.shape:
            case Cylinder(radius, length):
                return WheelJoint(joint, place, radius, length, steered)
            case Sphere(radius):
                return WheelJoint(joint, place, radius, radius / 2, steered)
            case _:
                continue
    return None


def _about(tree: Tree, joint: Joint, direction: int) -> bool:
    """Whether its axis points along the root's x, y or z (0, 1, 2), either way."""
    turn = tree.poses[joint.child]._replace(x=0.0, y=0.0, z=0.0)
    axis = turn.compose(Pose3(*joint.axis)).position
    return abs(axis[direction]) >= ALONG
