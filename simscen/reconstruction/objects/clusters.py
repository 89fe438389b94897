"""Groups the hits of each scan that are not from the static world into clusters, one cluster per visible object."""

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
"""Minimum number of hits of a cluster, and maximum number of beams without a hit between two hits of a cluster."""
MAX_GAP_M, MAX_GAP_BEAMS = 0.25, 3.0
"""Maximum distance between neighbor hits of a cluster: the larger of a distance and a multiple of the beam spacing."""
MAX_WALL_HIT_DISTANCE_TRUE_POSES_M = 0.12
"""Maximum distance between a wall and a hit that belongs to it, if the poses of the drive are true."""
MAX_WALL_HIT_DISTANCE_M, MAX_WALL_HIT_DISTANCE_PER_M = 0.2, 0.02
"""The same distance for estimated poses: a constant, and an addition per m of range."""


@dataclass(frozen=True, eq=False)
class ScanCluster:
    """Hits of one object in one scan.

    Attributes:
        scan: Index of the scan.
        time: Time of the scan in s.
        points: Hits (m, 2) in the map frame.
        lidar: Position (2,) of the lidar in the map frame.
        angle: Angle in rad that the hits cover, seen from the lidar.
        is_fully_visible: Whether nothing hides a part of the object: the beams on both sides end farther away.
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
    """Return a mask (n,) of scans that are neither invalid nor a repetition of the previous scan."""
    return ~compared.is_invalid & ~repeated_scans(compared.scans)


def scan_clusters(compared: ComparedScans, world: StaticWorld, has_true_poses: bool) -> list[list[ScanCluster]]:
    """Return the clusters of each scan, in the order of the scans; [] for a scan without clusters."""
    unexplained = compared.is_short & ~isolated_returns(compared) & usable_scans(compared)[:, None]
    for first, last, _ in ghost_beams(compared):
        unexplained[:, first : last + 1] = False
    rows, beams = np.nonzero(unexplained)
    if len(rows):
        fixed = MAX_WALL_HIT_DISTANCE_TRUE_POSES_M if has_true_poses else MAX_WALL_HIT_DISTANCE_M
        growth = 0.0 if has_true_poses else MAX_WALL_HIT_DISTANCE_PER_M
        limit = fixed + growth * compared.scans.ranges[rows, beams]
        near = world.distance_to_walls(compared.ends[rows, beams]) < limit
        unexplained[rows[near], beams[near]] = False
    return [[*_clusters(compared, row, np.flatnonzero(unexplained[row]))] for row in range(len(compared.scans))]


def _clusters(compared: ComparedScans, row: int, beams: Indices) -> Iterator[ScanCluster]:
    """Yield the clusters of `beams` (k,) of the scan `row`.

    In a scan of 360°, the first and the last beam can be in the same cluster.
    """
    if len(beams) < MIN_HITS:
        return
    step = abs(float(compared.scans.angles[1] - compared.scans.angles[0])) if len(compared.scans.angles) > 1 else 0.0
    ranges, points = compared.scans.ranges[row], compared.ends[row]
    total = len(ranges)
    following = np.roll(beams, -1)
    gaps = np.hypot(*(points[following] - points[beams]).T)
    limit = np.maximum(MAX_GAP_M, MAX_GAP_BEAMS * step * np.minimum(ranges[following], ranges[beams]))
    apart = ((following - beams) % total > MAX_SKIPPED_BEAMS + 1) | (gaps > limit)
    groups = np.split(beams, np.flatnonzero(apart[:-1]) + 1)
    full = abs(total * step - 2 * np.pi) < 1.5 * step
    if full and not apart[-1] and len(groups) > 1:
        groups = [np.concatenate((groups[-1], groups[0])), *groups[1:-1]]
    for group in groups:
        if len(group) < MIN_HITS:
            continue
        span = (int(group[-1]) - int(group[0])) % total
        sides = [(int(group[0]) - 1) % total, (int(group[-1]) + 1) % total]
        if not full and (group[0] == 0 or group[-1] == total - 1):
            is_fully_visible = False
        else:
            with np.errstate(invalid="ignore"):
                farther = ranges[sides] > ranges[[group[0], group[-1]]]
            is_fully_visible = bool(farther.all())
        lidar = compared.poses[row, :2]
        time = float(compared.scans.times[row])
        yield ScanCluster(row, time, points[group], lidar, (span + 1) * step, is_fully_visible)


FREE_MARGIN_M, MIN_VISIBLE_FRACTION = 0.25, 0.3
"""Minimum distance from a free point to the end of the beam through it, and minimum fraction of visible points in a
scan."""


def fraction_seen_free(compared: ComparedScans, points: Array, rows: Indices) -> Array:
    """Return the fraction (k,) of free points among the visible points in each scan of `rows` (k,).

    `points` (m, 2) are in the map frame. A point is free if a beam passes through the point. The fraction is nan if too
    few points are visible.
    """
    offsets = points[None, :, :] - compared.poses[rows, None, :2]
    distance = np.hypot(offsets[..., 0], offsets[..., 1])
    direction = np.arctan2(offsets[..., 1], offsets[..., 0]) - compared.poses[rows, None, 2]
    step = float(compared.scans.angles[1] - compared.scans.angles[0])
    beam = np.round(((direction - compared.scans.angles[0]) % (2 * np.pi)) / step).astype(np.int64)
    beam = np.where(beam == round(2 * np.pi / abs(step)), 0, beam)
    inside = (beam >= 0) & (beam < len(compared.scans.angles)) & (distance < compared.scans.range_max)
    measured = compared.scans.ranges[rows[:, None], np.where(inside, beam, 0)]
    with np.errstate(invalid="ignore"):
        free = inside & (measured > distance + FREE_MARGIN_M)
        hidden = ~inside | np.isnan(measured) | (measured < distance - FREE_MARGIN_M)
    visible = (~hidden).sum(axis=1)
    enough = visible >= max(2, MIN_VISIBLE_FRACTION * len(points))
    return np.where(enough, free.sum(axis=1) / np.maximum(visible, 1), np.nan)
