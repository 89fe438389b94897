"""Warns about wheels and casters of a URDF at wrong heights."""

from collections.abc import Iterator

import numpy as np

from simscen.core.errors import Problem
from simscen.model.robot import Drive
from simscen.sim.body.outline import hull_points
from simscen.sim.urdf.elements import LinkTree
from simscen.sim.urdf.wheels import WheelJoint, select_wheels

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
    """Return warnings about wheels at different heights, links below the wheels, and a caster that is too high."""
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
