"""What a URDF draws lower or higher than the ground that its wheels stand on, which simscen sets right unasked."""

from collections.abc import Iterator

import numpy as np

from simscen.core.errors import Problem
from simscen.model.robot import Drive
from simscen.sim.body.outline import hull_points
from simscen.sim.urdf.tree import Tree
from simscen.sim.urdf.wheels import WheelJoint, select_wheels

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
