"""Finds lidar faults from beams that end too early (dust, ghosts) or pass through walls (glass).

A ghost is an apparent object that moves with the lidar.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from simscen.core.geometry import Array
from simscen.core.geometry.shapes import Solid
from simscen.reconstruction.compared_scans import ComparedScans
from simscen.reconstruction.drive.recorded_drive import Mask
from simscen.reconstruction.faults.lidar_readings import (
    MIN_SECTOR_BEAMS,
    MIN_WINDOW_S,
    lidar_fault_in_window,
    mask_runs,
    usable_windows,
)
from simscen.reconstruction.reasons import FoundFault, Reason, find_windows
from simscen.reconstruction.static_world import StaticWorld, beam_ends
from simscen.worlds.geometry.triangulation import merge_solids

MIN_FALSE_FRACTION = 0.015
"""Minimum fraction of isolated beams in a scan that shows dust."""
JUMP_M = 0.3
"""Minimum difference between the ranges of neighbor beams that end at different objects."""
NEIGHBOR_BEAMS, SAME_OBJECT_M = 3, 0.3
"""Distance in beams from a ghost at which the ghost must not be visible, and maximum range difference between beams on
one object."""
MIN_GHOST_FRACTION = 0.3
"""Minimum fraction of the scans, from the first to the last scan with the ghost, that show the ghost."""
MAX_GHOST_SPREAD_M, GHOST_SPREAD_SIGMAS = 0.02, 2.0
"""Maximum median deviation of the range of a ghost: the larger of a distance and a multiple of the range noise."""
MIN_DRIVEN_M, MIN_GHOST_S = 0.6, 2.0
"""Minimum diagonal of the area in which the lidar moves, and minimum time, while a ghost is visible."""


def false_return_faults(compared: ComparedScans, end: float) -> Iterator[FoundFault]:
    """Yield the faults dust (single beams that end in free space) and ghost. `end` is the end of the drive in s."""
    usable = ~compared.is_invalid
    isolated = isolated_returns(compared)
    for window in usable_windows(isolated.mean(axis=1) > MIN_FALSE_FRACTION, compared):
        rows = usable[window.samples]
        ranges = np.where(
            compared.is_hit, compared.scans.ranges, np.minimum(compared.expected, compared.scans.range_max)
        )
        travelled = ranges[window.samples][rows]
        count = int(isolated[window.samples][rows].sum())
        if count < 20:
            continue
        length = float(np.nansum(np.where(np.isfinite(travelled), travelled, 0.0))) / count
        text = f"{count} single beams end in free space"
        yield lidar_fault_in_window("dust", {"mean_free_path": f"{length:.0f} m"}, window, compared, end, text)
    for first, last, distance in ghost_beams(compared):
        angles = np.degrees(compared.scans.angles)
        center, width = (angles[first] + angles[last]) / 2, angles[last] - angles[first] + 1.0
        share = float(compared.is_short[usable][:, first : last + 1].mean())
        values = {
            "range": f"{distance:.2f} m",
            "direction": f"{center:.0f} deg",
            "width": f"{width:.0f} deg",
            "probability": f"{100 * share:.0f} %",
        }
        text = f"something {distance:.2f} m away moves with the lidar"
        shown = compared.is_short[:, first : last + 1].mean(axis=1) > 0.3
        for window in find_windows(shown & usable, compared.scans.times, MIN_WINDOW_S, 2.0):
            yield lidar_fault_in_window("ghost", values, window, compared, end, text)
            break


def isolated_returns(compared: ComparedScans) -> Mask:
    """Return a mask (n, beams) of beams that end before the static world, and far from the ends of neighbor beams."""
    ranges = np.where(compared.is_hit, compared.scans.ranges, np.inf)
    with np.errstate(invalid="ignore"):
        steps = np.abs(np.diff(ranges, axis=1))
    apart = np.ones((len(ranges), ranges.shape[1] + 1), dtype=bool)
    apart[:, 1:-1] = ~(steps < JUMP_M)
    return compared.is_short & apart[:, 1:] & apart[:, :-1]


def ghost_beams(compared: ComparedScans) -> list[tuple[int, int, float]]:
    """Return the first beam, the last beam, and the range in m of each ghost."""
    if float(np.hypot(*np.ptp(compared.poses[:, :2], axis=0))) < MIN_DRIVEN_M:
        return []
    short = compared.is_short & ~compared.is_invalid[:, None]
    seen = short.sum(axis=0)
    ranges = np.where(short, compared.scans.ranges, np.nan)
    center, spread = np.full(len(seen), np.nan), np.full(len(seen), np.inf)
    chosen = seen >= max(5, 0.1 * len(short))
    if chosen.any():
        center[chosen] = np.nanmedian(ranges[:, chosen], axis=0)
        spread[chosen] = np.nanmedian(np.abs(ranges[:, chosen] - center[chosen]), axis=0)
    moved = np.zeros(len(seen), dtype=bool)
    for beam in np.flatnonzero(chosen).tolist():
        rows = short[:, beam] & (np.abs(ranges[:, beam] - center[beam]) < 2 * MAX_GHOST_SPREAD_M)
        long = bool(rows.any()) and float(np.ptp(compared.scans.times[rows])) > MIN_GHOST_S
        moved[beam] = long and float(np.hypot(*np.ptp(compared.poses[rows, :2], axis=0))) > MIN_DRIVEN_M
    first, last = np.argmax(short, axis=0), len(short) - 1 - np.argmax(short[::-1], axis=0)
    share = seen / np.maximum(last - first + 1, 1)
    limit = max(MAX_GHOST_SPREAD_M, GHOST_SPREAD_SIGMAS * float(np.median(compared.noise)))
    fixed = chosen & moved & (spread < limit) & (share > MIN_GHOST_FRACTION)
    ghosts = [(a, b, float(np.median(center[a : b + 1]))) for a, b in mask_runs(fixed) if b - a + 1 >= MIN_SECTOR_BEAMS]
    return [(a, b, distance) for a, b, distance in ghosts if not _is_wider(ranges, a, b, distance)]


def _is_wider(ranges: Array, first: int, last: int, distance: float) -> bool:
    """Return whether the object at the range `distance` is usually wider than the beams from `first` to `last`.

    `ranges` (n, beams) are nan for beams that do not end before the static world.
    """
    with np.errstate(invalid="ignore"):
        same = np.abs(ranges - distance) < SAME_OBJECT_M
    rows = same[:, (first + last) // 2]
    neighbors = [beam for beam in (first - NEIGHBOR_BEAMS, last + NEIGHBOR_BEAMS) if 0 <= beam < ranges.shape[1]]
    return any(float(same[rows, beam].mean()) > 0.5 for beam in neighbors) if rows.any() else False


MIN_PASSING_FRACTION, MIN_PASSING_BEAMS = 0.3, 30
"""Minimum fraction, and minimum number, of the beams toward a wall that pass through a transparent wall."""
MAX_SURFACE_DISTANCE_M = 0.05
"""Maximum distance between a solid and the expected end of a beam that should end at the solid."""


def glass_fault(compared: ComparedScans, world: StaticWorld, usable: Mask) -> FoundFault | None:
    """Return a fault if beams of `usable` scans (n,) pass through named walls or obstacles; otherwise None."""
    rows = np.flatnonzero(usable)
    # A beam without any return may have been lost; only one that ends behind the wall has passed through it.
    through = compared.passes_through[rows] & compared.is_hit[rows]
    if int(through.sum()) < MIN_PASSING_BEAMS:
        return None
    ends = beam_ends(compared.poses[rows], compared.scans.angles, compared.expected[rows])
    decided = through | compared.is_explained[rows]
    decided &= np.isfinite(compared.expected[rows])
    shares = _passing_fractions(world.world.solids, ends[decided], through[decided])
    names = [
        name
        for name, (count, share) in shares.items()
        if share > MIN_PASSING_FRACTION and count * share >= MIN_PASSING_BEAMS
    ]
    if not names:
        return None
    total = sum(shares[name][0] for name in names)
    share = sum(shares[name][0] * shares[name][1] for name in names) / total
    text = f"{100 * share:.0f} % of {total} beams pass through {' and '.join(names)}"
    values = {"of": names, "probability": f"{100 * share:.0f} %"}
    times = compared.scans.times[rows][through.any(axis=1)]
    return FoundFault("lidar", "glass", values, reason=Reason(text, float(times[0]), float(times[-1]), "medium"))


def _passing_fractions(solids: tuple[Solid, ...], points: Array, passed: Mask) -> dict[str, tuple[int, float]]:
    """Return by solid name the number of beams that should end at the solid, and the fraction that passes through it.

    `points` (n, 2) are the expected ends of beams in the map frame. `passed` (n,) is a mask of passing beams.
    """
    counts: dict[str, list[int]] = {}
    for solid in solids:
        if not solid.name or solid.name == "map":
            continue
        inside = _is_near(solid, points)
        count = counts.setdefault(solid.name, [0, 0])
        count[0] += int(inside.sum())
        count[1] += int(passed[inside].sum())
    return {name: (total, through / total) for name, (total, through) in sorted(counts.items()) if total}


def _is_near(solid: Solid, points: Array) -> Mask:
    """Return a mask (n,) of points (n, 2) in or near the convex hull of a solid, seen from above."""
    from scipy.spatial import ConvexHull

    corners = merge_solids((solid,)).vertices[:, :2]
    hull = ConvexHull(corners)
    result: Mask = (points @ hull.equations[:, :2].T + hull.equations[:, 2] <= MAX_SURFACE_DISTANCE_M).all(axis=1)
    return result
