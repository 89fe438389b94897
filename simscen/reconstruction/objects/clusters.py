"""Groups the hits in each scan that are not from the static world into clusters, one for each visible object."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from simscen.core.geometry import Array
from simscen.reconstruction.compared_scans import ComparedScans
from simscen.reconstruction.drive.recorded_drive import Indices, Mask
from simscen.reconstruction.faults.false_returns import ghost_beams, isolated_returns
from simscen.reconstruction.faults.message_stream import repeated_scans
from simscen.reconstruction.static_world import StaticWorld

MIN_HITS, MAX_SKIPPED_BEAMS = 3, 2
"""Minimum number of hits in a cluster, and maximum number of beams without a hit between two hits of a cluster."""
MAX_GAP_M, MAX_GAP_BEAMS = 0.25, 3.0
"""Maximum distance between neighbor hits of a cluster: the larger of a distance and a multiple of the beam spacing."""
MAX_WALL_HIT_DISTANCE_TRUE_POSES_M = 0.12
"""Maximum distance between a wall and a hit on the wall, for a drive with true poses."""
MAX_WALL_HIT_DISTANCE_M, MAX_WALL_HIT_DISTANCE_PER_M = 0.2, 0.02
"""Maximum distance between a wall and a hit on the wall, for a drive with estimated poses: a constant, and an addition
per m of range."""
FREE_MARGIN_M = 0.25
"""Minimum distance from a free point to the end of the beam through the point."""
MIN_VISIBLE_FRACTION = 0.3
"""Minimum fraction of visible points in a scan for a result of `fraction_seen_free`."""


@dataclass(frozen=True, eq=False)
class ScanCluster:
    """Hits of one object in one scan.

    Attributes:
        scan: Index of the scan.
        time: Time of the scan in s.
        points: Hits (m, 2) in the map frame.
        lidar: Position (2,) of the lidar in the map frame.
        angle: Angle in rad that the hits cover, seen from the lidar.
        is_fully_visible: Whether nothing hides a part of the object, because the beams on both sides end farther away.
    """

    scan: int
    time: float
    points: Array
    lidar: Array
    angle: float
    is_fully_visible: bool

    @property
    def center(self) -> Array:
        """Center (2,) of the bounding box of the hits."""
        center: Array = (self.points.min(axis=0) + self.points.max(axis=0)) / 2
        return center


def usable_scans(compared: ComparedScans) -> Mask:
    """Return a mask (n,) of scans that are valid and do not repeat the previous scan."""
    return ~compared.is_invalid & ~repeated_scans(compared.scans)


def scan_clusters(compared: ComparedScans, world: StaticWorld, has_true_poses: bool) -> list[list[ScanCluster]]:
    """Return the clusters of each scan, in the order of the scans; [] for a scan without clusters."""
    is_object = compared.is_short & ~isolated_returns(compared) & usable_scans(compared)[:, None]
    for first, last, _ in ghost_beams(compared):
        is_object[:, first : last + 1] = False
    rows, beams = np.nonzero(is_object)
    if len(rows):
        base_limit = MAX_WALL_HIT_DISTANCE_TRUE_POSES_M if has_true_poses else MAX_WALL_HIT_DISTANCE_M
        limit_per_m = 0.0 if has_true_poses else MAX_WALL_HIT_DISTANCE_PER_M
        limits = base_limit + limit_per_m * compared.scans.ranges[rows, beams]
        is_wall = world.distance_to_walls(compared.ends[rows, beams]) < limits
        is_object[rows[is_wall], beams[is_wall]] = False
    return [[*_clusters(compared, row, np.flatnonzero(is_object[row]))] for row in range(len(compared.scans))]


def _clusters(compared: ComparedScans, row: int, beams: Indices) -> Iterator[ScanCluster]:
    """Yield the clusters of the hits of `beams` (k,) in the scan `row`.

    In a scan of 360°, the first and the last beam can be in the same cluster.
    """
    if len(beams) < MIN_HITS:
        return
    step = abs(float(compared.scans.angles[1] - compared.scans.angles[0])) if len(compared.scans.angles) > 1 else 0.0
    ranges, points = compared.scans.ranges[row], compared.ends[row]
    beam_count = len(ranges)
    next_beams = np.roll(beams, -1)
    gaps = np.hypot(*(points[next_beams] - points[beams]).T)
    limits = np.maximum(MAX_GAP_M, MAX_GAP_BEAMS * step * np.minimum(ranges[next_beams], ranges[beams]))
    is_separate = ((next_beams - beams) % beam_count > MAX_SKIPPED_BEAMS + 1) | (gaps > limits)
    groups = np.split(beams, np.flatnonzero(is_separate[:-1]) + 1)
    is_full_circle = abs(beam_count * step - 2 * np.pi) < 1.5 * step
    if is_full_circle and not is_separate[-1] and len(groups) > 1:
        groups = [np.concatenate((groups[-1], groups[0])), *groups[1:-1]]
    for group in groups:
        if len(group) < MIN_HITS:
            continue
        span = (int(group[-1]) - int(group[0])) % beam_count
        sides = [(int(group[0]) - 1) % beam_count, (int(group[-1]) + 1) % beam_count]
        if not is_full_circle and (group[0] == 0 or group[-1] == beam_count - 1):
            is_fully_visible = False
        else:
            with np.errstate(invalid="ignore"):
                is_farther = ranges[sides] > ranges[[group[0], group[-1]]]
            is_fully_visible = bool(is_farther.all())
        lidar = compared.poses[row, :2]
        time = float(compared.scans.times[row])
        yield ScanCluster(row, time, points[group], lidar, (span + 1) * step, is_fully_visible)


def fraction_seen_free(compared: ComparedScans, points: Array, rows: Indices) -> Array:
    """Return the fraction (k,) of free points among the visible points in each scan of `rows` (k,).

    `points` (m, 2) are in the map frame. `rows` are the indices of scans. A point is free if a beam passes through the
    point. The fraction is nan if too few points are visible.
    """
    offsets = points[None, :, :] - compared.poses[rows, None, :2]
    distances = np.hypot(offsets[..., 0], offsets[..., 1])
    directions = np.arctan2(offsets[..., 1], offsets[..., 0]) - compared.poses[rows, None, 2]
    step = float(compared.scans.angles[1] - compared.scans.angles[0])
    beams = np.round(((directions - compared.scans.angles[0]) % (2 * np.pi)) / step).astype(np.int64)
    beams = np.where(beams == round(2 * np.pi / abs(step)), 0, beams)
    is_in_view = (beams >= 0) & (beams < len(compared.scans.angles)) & (distances < compared.scans.range_max)
    measured = compared.scans.ranges[rows[:, None], np.where(is_in_view, beams, 0)]
    with np.errstate(invalid="ignore"):
        is_free = is_in_view & (measured > distances + FREE_MARGIN_M)
        is_hidden = ~is_in_view | np.isnan(measured) | (measured < distances - FREE_MARGIN_M)
    visible_count = (~is_hidden).sum(axis=1)
    are_enough = visible_count >= max(2, MIN_VISIBLE_FRACTION * len(points))
    return np.where(are_enough, is_free.sum(axis=1) / np.maximum(visible_count, 1), np.nan)
