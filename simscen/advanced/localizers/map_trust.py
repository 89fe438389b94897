"""Agreement of scans with the map, and lower weights of scans if the map is outdated.

The mapped area consists of all known cells and of the inside of walls.
"""

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from simscen.core.environment.occupancy_grid import FREE, UNKNOWN, OccupancyGrid
from simscen.core.geometry import Array
from simscen.stack.costmap.distance_transform import MAX_REACH_CELLS, squared_distances_within
from simscen.stack.localizers.beams import Beams, ComplexPoints, TableIndices
from simscen.stack.localizers.distance_field import BLOCK_POSES, DistanceField
from simscen.stack.localizers.particles import Particles

MAX_WALL_THICKNESS_M = 1.0
"""Unknown cells farther than this from all known cells may be unmapped rooms, and not the inside of a wall."""


def unmapped_cells(grid: OccupancyGrid) -> npt.NDArray[np.bool_]:
    """Return the mask (rows + 2, columns + 2) of the cells outside the mapped area, with a border of one cell.

    An unknown cell is outside the mapped area if its nearest known cell is free, or if all known cells are farther away
    than MAX_WALL_THICKNESS_M. The other unknown cells are the inside of walls.
    """
    unknown = np.pad(grid.cells == UNKNOWN, 1, constant_values=True)
    if unknown.all():
        return unknown
    is_only_border_unknown = np.count_nonzero(unknown) == unknown.size - grid.cells.size
    if is_only_border_unknown and math.sqrt(2) * grid.resolution <= MAX_WALL_THICKNESS_M:
        next_to_free: npt.NDArray[np.bool_] = np.pad(grid.cells == FREE, 1, mode="edge")
        return unknown & next_to_free
    reach = min(MAX_REACH_CELLS, math.ceil(MAX_WALL_THICKNESS_M / grid.resolution))
    to_known = squared_distances_within(~unknown, reach)
    unmapped: npt.NDArray[np.bool_] = squared_distances_within(np.pad(grid.cells == FREE, 1), reach) == to_known
    unmapped |= to_known > (MAX_WALL_THICKNESS_M / grid.resolution) ** 2
    unmapped &= unknown
    return unmapped


FIT_DISTANCE_M = 0.3
"""Distance from an obstacle of the map below which the endpoint of a beam fits."""
CLUSTER_RADIUS_M = 1.0
"""Particles are one narrow cluster if all are within this distance of their mean, along x and along y."""
SAMPLED_PARTICLES = 50
"""Approximate number of particles at which beams are compared with the map."""
MAPPED_SHARE = 0.1, 0.8
"""Limits of the share of beams that end on the mapped area. Up to the first limit, a scan is ignored. From the second
limit on, a scan has its full weight."""
MIN_PARTICLE_SHARE = 0.5
"""A beam is used if it ends on the mapped area for more than this share of the particles."""
_UNMAPPED, _FITS, _MISSES = 0, 1, 2
"""Classes of cells for the endpoint of a beam."""


class ScanWeight(NamedTuple):
    """Weight of a scan.

    exponent:       exponent of the likelihood, 0 (scan is ignored) … 1
    fitting_share:  share of fitting beams among the beams that end on the mapped area
    used_hits:      mask (m,) of the hits to use, among the m beams with a hit; None for all
    """

    exponent: float
    fitting_share: float
    used_hits: npt.NDArray[np.bool_] | None


class MapTrust:
    """Determines how much weight a scan has in the update of the particle filter.

    The weight is low if few beams end on the mapped area. It is also low if few beams fit the map while the particles
    are one narrow cluster: the pose is then probably right, and the map outdated.
    """

    def __init__(self, field: DistanceField, unmapped: npt.NDArray[np.bool_], zero: float, full: float) -> None:
        """Classify the cells of a map. `unmapped` marks cells of `field.table` outside the mapped area.

        A scan is ignored if at most the share `zero` of its beams fits. From the share `full` on, it counts fully.
        """
        self._field, self._zero, self._full = field, zero, full
        mapped = np.where(field.table < FIT_DISTANCE_M, _FITS, _MISSES)
        self._class_table = np.where(unmapped, _UNMAPPED, mapped).astype(np.uint8)

    def weight(self, particles: Particles, beams: Beams) -> ScanWeight:
        """Return the weight of a scan.

        For a narrow cluster, only beams that end on the mapped area for most particles are used. The other beams would
        draw the particles to the edge of the map, or push them away from this edge.
        """
        classes = self._classes(self._endpoint_cells(particles.poses, beams))
        mapped_share, fitting = _shares(classes)
        exponent = _ramp(mapped_share, *MAPPED_SHARE)
        if not particles.are_within(CLUSTER_RADIUS_M):
            return ScanWeight(exponent, fitting, None)
        used_hits = None
        if mapped_share < 1.0:
            used_hits = np.add.reduce(classes != _UNMAPPED, axis=0) > MIN_PARTICLE_SHARE * len(classes)
        return ScanWeight(exponent * _ramp(fitting, self._zero, self._full), fitting, used_hits)

    def fitting_share(self, poses: Array, ends: ComplexPoints, min_mapped: float) -> float | None:
        """Return the share of fitting beams at `poses` (n, 3), among the beams that end on the mapped area.

        `ends` are the endpoints in the base frame. None if less than the share `min_mapped` ends on the mapped area.
        """
        mapped_share, fitting = _shares(self._classes(self._field.endpoint_cells(poses, ends)))
        return fitting if mapped_share and mapped_share >= min_mapped else None

    def _endpoint_cells(self, poses: Array, beams: Beams) -> TableIndices:
        """Return the cells of the endpoints for about SAMPLED_PARTICLES of the `poses` (n, 3)."""
        # For few poses, the cells of all poses are cached.
        step = -(-len(poses) // SAMPLED_PARTICLES)
        if len(poses) <= BLOCK_POSES:
            return beams.cells(self._field, poses)[::step]
        return self._field.endpoint_cells(poses[::step], beams.ends)

    def _classes(self, cells: TableIndices) -> npt.NDArray[np.uint8]:
        """Return the class of each cell: _UNMAPPED, _FITS, or _MISSES."""
        classes: npt.NDArray[np.uint8] = self._class_table.take(cells, mode="wrap")
        return classes


def _shares(classes: npt.NDArray[np.uint8]) -> tuple[float, float]:
    """Return the share of the endpoints on the mapped area, and the share of these that fit."""
    mapped, fitting = int(np.count_nonzero(classes)), int(np.count_nonzero(classes == _FITS))
    return mapped / max(classes.size, 1), fitting / max(mapped, 1)


def _ramp(value: float, none: float, full: float) -> float:
    """Return 0 for values up to `none`, 1 for values from `full` on, and linear values in between."""
    return 1.0 if value >= full else max(0.0, (value - none) / (full - none))
