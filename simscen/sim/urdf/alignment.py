"""Warns about wheels and casters of a URDF at wrong heights."""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from simscen.core.errors import Problem
from simscen.model.robot import Drive
from simscen.sim.body.outline import hull_points
from simscen.sim.urdf.link_tree import LinkTree
from simscen.sim.urdf.wheels import WheelJoint, select_wheels

ALIGNMENT_CODE = "SC405"
"""Code of all warnings about the heights of wheels and casters."""
HEIGHT_TOLERANCE_M = 0.0005
"""Largest difference in m between the heights of parts that stand on the ground."""
MAX_CASTER_GAP_M = 0.003
"""Largest gap in m between a caster and the ground that causes no warning."""
MAX_INTENDED_CASTER_GAP_M = 0.02
"""Gap in m from which on a small link above the ground is not meant to be a caster."""
MAX_CASTER_SIZE_M = 0.1
"""Largest length and width in m of a link that is probably meant to be a caster."""


def alignment_warnings(tree: LinkTree, drive: Drive) -> list[Problem]:
    """Return warnings about wheels at different heights, links below the wheels, and a caster that is too high."""
    wheels = select_wheels(tree, drive)
    if not wheels:
        return []
    ground = min(wheel.bottom for wheel in wheels)
    found = [*_wheel_warnings(wheels, ground), *_caster_warnings(tree, wheels, ground, drive.type == "differential")]
    return [replace(problem, code=ALIGNMENT_CODE, severity="warning") for problem in found]


def _wheel_warnings(wheels: list[WheelJoint], ground: float) -> Iterator[Problem]:
    for wheel in wheels:
        gap = wheel.bottom - ground
        if gap > HEIGHT_TOLERANCE_M:
            message = f"the wheel on joint {wheel.joint.name!r} is {1e3 * gap:.1f} mm higher than the lowest wheel"
            yield wheel.joint.element.problem(message, "simscen places all wheels on the ground")


def _caster_warnings(tree: LinkTree, wheels: list[WheelJoint], ground: float, needs_caster: bool) -> Iterator[Problem]:
    rolling_links = {link for wheel in wheels for link in tree.subtree(wheel.joint.child)}
    points = {
        name: np.concatenate([tree.poses[name].compose(s.pose).apply(hull_points(s.shape)) for s in link.solids])
        for name, link in tree.links.items()
        if name not in rolling_links and link.solids
    }
    gaps = {name: float(corners[:, 2].min()) - ground for name, corners in points.items()}
    for name, gap in gaps.items():
        if gap < -HEIGHT_TOLERANCE_M:
            message = (
                f"link {name!r} reaches {-1e3 * gap:.1f} mm below the wheels, which would lose contact with the ground"
            )
            consequence = (
                "uses frictionless spheres as casters instead" if needs_caster else "leaves it out of the hull"
            )
            hint = f"raise it by {-gap:.4g} m; simscen {consequence}"
            yield tree.links[name].element.problem(message, hint)
    lowest = min(gaps, key=lambda name: gaps[name], default=None)
    if not needs_caster or lowest is None:
        return
    size = np.ptp(points[lowest][:, :2], axis=0).max()
    if MAX_CASTER_GAP_M < gaps[lowest] < MAX_INTENDED_CASTER_GAP_M and size <= MAX_CASTER_SIZE_M:
        message = (
            f"link {lowest!r} is {1e3 * gaps[lowest]:.1f} mm above the ground, so that the robot would tip onto it"
        )
        hint = f"lower it by {gaps[lowest]:.4g} m; simscen uses spheres that touch the ground as casters instead"
        yield tree.links[lowest].element.problem(message, hint)
