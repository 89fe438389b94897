"""Which joints of a URDF are wheels, and which steer."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from simscen.core.errors import InvalidInput, Problem
from simscen.core.geometry import Pose3
from simscen.core.geometry.shapes import Cylinder, Sphere
from simscen.model.robot import Ackermann, Differential, Drive, Omnidirectional
from simscen.sim.body.outline import hull_points
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
    """Return the wheels in a URDF: continuous joints with a lateral axis and a round link."""
    steering = steered_links(tree, [j for j in tree.joints.values() if j.type in TURNING and _about(tree, j, 2)])
    wheels = [
        wheel_joint(tree, joint, joint.child in steering)
        for joint in tree.joints.values()
        if joint.type == "continuous" and _about(tree, joint, 1)
    ]
    return sorted((w for w in wheels if w is not None), key=lambda w: (w.place[0], -w.place[1], w.joint.name))


def select_wheels(tree: Tree, drive: Drive) -> list[WheelJoint]:
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
    """Return the wheel on a joint by its collision shape, or None if that is not round."""
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


CODE = "SC405"
EVEN = 0.0005
"""m by which what stands on the ground may differ in height."""
RAISED = 0.003
"""m that a caster may hang above the ground: the robot then leans on another, or rocks by a hair."""
NEAR = 0.02
"""m above the ground within which something small is meant to be a caster."""
SMALL = 0.1
"""m: neither the length nor the width of a caster exceeds it."""


def alignment_warnings(tree: Tree, drive: Drive) -> list[Problem]:
    """Warnings about wheels at different heights, and about casters that are too low or too high."""
    wheels = select_wheels(tree, drive)
    if not wheels:
        return []
    ground = min(wheel.place[2] - wheel.radius for wheel in wheels)
    found = [*_wheels(wheels, ground), *_parts(tree, wheels, ground, drive.type == "differential")]
    return [Problem(p.path, p.line, p.col, CODE, p.message, p.hint, "warning", p.source) for p in found]


def _wheels(wheels: list[WheelJoint], ground: float) -> Iterator[Problem]:
    for wheel in wheels:
        gap = wheel.place[2] - wheel.radius - ground
        if gap > EVEN:
            message = f"the wheel on joint {wheel.joint.name!r} hangs {1e3 * gap:.1f} mm above the lowest one's ground"
            yield wheel.joint.element.problem(message, "simscen lets all of them stand on the ground")


def _parts(tree: Tree, wheels: list[WheelJoint], ground: float, on_casters: bool) -> Iterator[Problem]:
    rolling = {link for wheel in wheels for link in tree.subtree(wheel.joint.child)}
    gaps = {
        name: _lowest(tree, name) - ground for name in tree.links if name not in rolling and tree.links[name].solids
    }
    for name, gap in gaps.items():
        if gap < -EVEN:
            message = (
                f"link {name!r} reaches {-1e3 * gap:.1f} mm below the wheels: as drawn it lifts them off the ground"
            )
            hint = f"raise it by {-gap:.4g} m; simscen drives it on frictionless balls in its place"
            yield tree.links[name].element.problem(message, hint)
    nearest = min(gaps, key=lambda name: gaps[name], default=None)
    if on_casters and nearest and RAISED < gaps[nearest] < NEAR and _is_small(tree, nearest):
        message = (
            f"link {nearest!r} hangs {1e3 * gaps[nearest]:.1f} mm above the ground: as drawn the robot tips onto it"
        )
        hint = f"lower it by {gaps[nearest]:.4g} m; simscen drives it on balls that touch the ground"
        yield tree.links[nearest].element.problem(message, hint)


def _points(tree: Tree, name: str) -> "np.ndarray[tuple[int, int], np.dtype[np.float64]]":
    pose = tree.poses[name]
    return np.concatenate([pose.compose(s.pose).apply(hull_points(s.shape)) for s in tree.links[name].solids])


def _lowest(tree: Tree, name: str) -> float:
    return float(_points(tree, name)[:, 2].min())


def _is_small(tree: Tree, name: str) -> bool:
    return bool((np.ptp(_points(tree, name)[:, :2], axis=0) <= SMALL).all())
