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

MIN_FALSE_FRACTION, MIN_FALSE_RETURNS = 0.015, 20
"""Minimum fraction of isolated beams in a scan with dust, and minimum number of isolated beams in all these scans."""
MIN_JUMP_M = 0.3
"""Minimum difference between the ranges of neighbor beams that end at different objects."""
NEIGHBOR_BEAMS, MAX_SAME_OBJECT_M = 3, 0.3
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
    is_usable = ~compared.is_invalid
    is_isolated = isolated_returns(compared)
    for window in usable_windows(is_isolated.mean(axis=1) > MIN_FALSE_FRACTION, compared):
        rows = is_usable[window.samples]
        ranges = np.where(
            compared.is_hit, compared.scans.ranges, np.minimum(compared.expected, compared.scans.range_max)
        )
        traveled = ranges[window.samples][rows]
        count = int(is_isolated[window.samples][rows].sum())
        if count < MIN_FALSE_RETURNS:
            continue
        length = float(np.nansum(np.where(np.isfinite(traveled), traveled, 0.0))) / count
        text = f"{count} single beams end in free space"
        yield lidar_fault_in_window("dust", {"mean_free_path": f"{length:.0f} m"}, window, compared, end, text)
    for first, last, distance in ghost_beams(compared):
        angles = np.degrees(compared.scans.angles)
        center, width = (angles[first] + angles[last]) / 2, angles[last] - angles[first] + 1.0
        probability = float(compared.is_short[is_usable][:, first : last + 1].mean())
        values = {
            "range": f"{distance:.2f} m",
            "direction": f"{center:.0f} deg",
            "width": f"{width:.0f} deg",
            "probability": f"{100 * probability:.0f} %",
        }
        text = f"something {distance:.2f} m away moves with the lidar"
        is_visible = compared.is_short[:, first : last + 1].mean(axis=1) > 0.3
        for window in find_windows(is_visible & is_usable, compared.scans.times, MIN_WINDOW_S, 2.0):
            yield lidar_fault_in_window("ghost", values, window, compared, end, text)
            break


def isolated_returns(compared: ComparedScans) -> Mask:
    """Return a mask (n, beams) of beams that end in front of the static world, far from the ends of neighbor beams."""
    ranges = np.where(compared.is_hit, compared.scans.ranges, np.inf)
    with np.errstate(invalid="ignore"):
        steps = np.abs(np.diff(ranges, axis=1))
    is_jump = np.ones((len(ranges), ranges.shape[1] + 1), dtype=bool)
    is_jump[:, 1:-1] = ~(steps < MIN_JUMP_M)
    return compared.is_short & is_jump[:, 1:] & is_jump[:, :-1]


def ghost_beams(compared: ComparedScans) -> list[tuple[int, int, float]]:
    """Return the first beam, the last beam, and the range in m of each ghost."""
    if float(np.hypot(*np.ptp(compared.poses[:, :2], axis=0))) < MIN_DRIVEN_M:
        return []
    is_short = compared.is_short & ~compared.is_invalid[:, None]
    counts = is_short.sum(axis=0)
    ranges = np.where(is_short, compared.scans.ranges, np.nan)
    center, spread = np.full(len(counts), np.nan), np.full(len(counts), np.inf)
    is_frequent = counts >= max(5, 0.1 * len(is_short))
    if is_frequent.any():
        center[is_frequent] = np.nanmedian(ranges[:, is_frequent], axis=0)
        spread[is_frequent] = np.nanmedian(np.abs(ranges[:, is_frequent] - center[is_frequent]), axis=0)
    moves_with_lidar = np.zeros(len(counts), dtype=bool)
    for beam in np.flatnonzero(is_frequent).tolist():
        rows = is_short[:, beam] & (np.abs(ranges[:, beam] - center[beam]) < 2 * MAX_GHOST_SPREAD_M)
        if rows.any() and float(np.ptp(compared.scans.times[rows])) > MIN_GHOST_S:
            moves_with_lidar[beam] = float(np.hypot(*np.ptp(compared.poses[rows, :2], axis=0))) > MIN_DRIVEN_M
    first_rows, last_rows = np.argmax(is_short, axis=0), len(is_short) - 1 - np.argmax(is_short[::-1], axis=0)
    fractions = counts / np.maximum(last_rows - first_rows + 1, 1)
    max_spread = max(MAX_GHOST_SPREAD_M, GHOST_SPREAD_SIGMAS * float(np.median(compared.noise)))
    is_ghost = is_frequent & moves_with_lidar & (spread < max_spread) & (fractions > MIN_GHOST_FRACTION)
    ghosts = [
        (first, last, float(np.median(center[first : last + 1])))
        for first, last in mask_runs(is_ghost)
        if last - first + 1 >= MIN_SECTOR_BEAMS
    ]
    return [ghost for ghost in ghosts if not _is_wider(ranges, *ghost)]


def _is_wider(ranges: Array, first: int, last: int, distance: float) -> bool:
    """Return whether the object at the range `distance` is usually wider than the beams from `first` to `last`.

    `ranges` (n, beams) are nan for beams that do not end in front of the static world.
    """
    with np.errstate(invalid="ignore"):
        is_same_object = np.abs(ranges - distance) < MAX_SAME_OBJECT_M
    rows = is_same_object[:, (first + last) // 2]
    neighbors = [beam for beam in (first - NEIGHBOR_BEAMS, last + NEIGHBOR_BEAMS) if 0 <= beam < ranges.shape[1]]
    return any(float(is_same_object[rows, beam].mean()) > 0.5 for beam in neighbors) if rows.any() else False


MIN_PASSING_FRACTION, MIN_PASSING_BEAMS = 0.3, 30
"""Minimum fraction, and minimum number, of the beams toward a wall that pass through a transparent wall."""
MAX_SURFACE_DISTANCE_M = 0.05
"""Maximum distance between a solid and the expected end of a beam that should end at the solid."""


def glass_fault(compared: ComparedScans, world: StaticWorld, usable: Mask) -> FoundFault | None:
    """Return a fault if beams pass through named walls or obstacles, otherwise None. `usable` (n,) is a scan mask."""
    rows = np.flatnonzero(usable)
    # A beam without a return may be lost. A beam that ends behind a wall has certainly passed through the wall.
    has_passed = compared.passes_through[rows] & compared.is_hit[rows]
    if int(has_passed.sum()) < MIN_PASSING_BEAMS:
        return None
    ends = beam_ends(compared.poses[rows], compared.scans.angles, compared.expected[rows])
    is_certain = (has_passed | compared.is_explained[rows]) & np.isfinite(compared.expected[rows])
    beams_by_name = _passing_beams(world.world.solids, ends[is_certain], has_passed[is_certain])
    names = [
        name
        for name, (count, passing_count) in beams_by_name.items()
        if passing_count > MIN_PASSING_FRACTION * count and passing_count >= MIN_PASSING_BEAMS
    ]
    if not names:
        return None
    total_count = sum(beams_by_name[name][0] for name in names)
    fraction = sum(beams_by_name[name][1] for name in names) / total_count
    text = f"{100 * fraction:.0f} % of {total_count} beams pass through {' and '.join(names)}"
    values = {"of": names, "probability": f"{100 * fraction:.0f} %"}
    times = compared.scans.times[rows][has_passed.any(axis=1)]
    return FoundFault("lidar", "glass", values, reason=Reason(text, float(times[0]), float(times[-1]), "medium"))


def _passing_beams(solids: tuple[Solid, ...], points: Array, has_passed: Mask) -> dict[str, tuple[int, int]]:
    """Return two numbers by name of a solid: beams that should end at the solid, and beams that pass through the solid.

    `points` (n, 2) are the expected ends of beams in the map frame. `has_passed` (n,) is a mask of passing beams.
    """
    counts: dict[str, tuple[int, int]] = {}
    for solid in solids:
        if not solid.name or solid.name == "map":
            continue
        is_near = _is_near(solid, points)
        count, passing_count = counts.get(solid.name, (0, 0))
        counts[solid.name] = count + int(is_near.sum()), passing_count + int(has_passed[is_near].sum())
    return dict(sorted(counts.items()))


def _is_near(solid: Solid, points: Array) -> Mask:
    """Return a mask (n,) of points (n, 2) in or near the convex hull of a solid, seen from above."""
    from scipy.spatial import ConvexHull

    corners = merge_solids((solid,)).vertices[:, :2]
    hull = ConvexHull(corners)
    result: Mask = (points @ hull.equations[:, :2].T + hull.equations[:, 2] <= MAX_SURFACE_DISTANCE_M).all(axis=1)
    return result
