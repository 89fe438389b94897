"""Walls and obstacles through which beams pass: glass, or things that are no longer where the map shows them."""

from __future__ import annotations

import numpy as np

from simscen.core.geometry import Array
from simscen.core.geometry.shapes import Solid
from simscen.reconstruction.drive.recorded_drive import Mask
from simscen.reconstruction.evidence import Evidence, FoundFault
from simscen.reconstruction.scans.scan_model import ScanModel
from simscen.reconstruction.scans.surroundings import Surroundings, beam_ends
from simscen.worlds.geometry.triangulation import merge_solids

MIN_PASSING_SHARE, MIN_PASSING_BEAMS = 0.3, 30
"""Share and number of beams through a wall from which on it counts as transparent."""
MAX_SURFACE_DISTANCE_M = 0.05
"""Distance from a solid within which an expected beam ends at it."""


def glass_fault(model: ScanModel, world: Surroundings, usable: Mask) -> FoundFault | None:
    """Return the fault of beams that pass through named walls and obstacles of the world, if there is one."""
    rows = np.flatnonzero(usable)
    # A beam without any return may have been lost; only one that ends behind the wall has passed through it.
    through = model.passes_through[rows] & model.is_hit[rows]
    if int(through.sum()) < MIN_PASSING_BEAMS:
        return None
    ends = beam_ends(model.poses[rows], model.scans.angles, model.expected[rows])
    decided = through | model.is_explained[rows]
    points, passed = (
        ends[decided & np.isfinite(model.expected[rows])],
        through[decided & np.isfinite(model.expected[rows])],
    )
    shares = _shares(world.world.solids, points, passed)
    names = [
        name
        for name, (count, share) in shares.items()
        if share > MIN_PASSING_SHARE and count * share >= MIN_PASSING_BEAMS
    ]
    if not names:
        return None
    total = sum(shares[name][0] for name in names)
    share = sum(shares[name][0] * shares[name][1] for name in names) / total
    text = f"{100 * share:.0f} % of {total} beams pass through {' and '.join(names)}"
    values = {"of": names, "probability": f"{100 * share:.0f} %"}
    times = model.scans.times[rows][through.any(axis=1)]
    return FoundFault("lidar", "glass", values, evidence=Evidence(text, float(times[0]), float(times[-1]), "medium"))


def _shares(solids: tuple[Solid, ...], points: Array, passed: Mask) -> dict[str, tuple[int, float]]:
    """Return for each named solid how many expected beam ends it has, and which share of the beams passes through."""
    counts: dict[str, list[int]] = {}
    for solid in solids:
        if not solid.name or solid.name == "map":
            continue
        inside = _near(solid, points)
        count = counts.setdefault(solid.name, [0, 0])
        count[0] += int(inside.sum())
        count[1] += int(passed[inside].sum())
    return {name: (total, through / total) for name, (total, through) in sorted(counts.items()) if total}


def _near(solid: Solid, points: Array) -> Mask:
    """Return which points (n, 2) are within MAX_SURFACE_DISTANCE_M of the convex hull of a solid, seen from above."""
    from scipy.spatial import ConvexHull

    corners = merge_solids((solid,)).vertices[:, :2]
    hull = ConvexHull(corners)
    result: Mask = (points @ hull.equations[:, :2].T + hull.equations[:, 2] <= MAX_SURFACE_DISTANCE_M).all(axis=1)
    return result
