"""Agreement of scans with the map: residuals of their endpoints, and the weight of scans if the map is outdated."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Array, Pose2
from simscen.stack.localizers.beams import Beams, Cells, Plane
from simscen.stack.localizers.distance_field import BLOCK_POSES, DistanceField
from simscen.stack.localizers.particles import Particles


class ScanResiduals(NamedTuple):
    """Residuals of one scan, of the beams that end on the mapped area.

    explained:    share of the beams that the map explains
    mean_square:  mean squared distance of the endpoints from obstacles, in units of `sigma_hit`²; a beam that the map
                  does not explain counts as 0
    """

    explained: float
    mean_square: float


class MapResiduals:
    """Measures how well the map explains scans.

    A beam hit the obstacle next to its endpoint with the probability hit / (hit + random), the two parts of its
    likelihood. Its residual is weighted by this probability, so that furniture that was moved a little increases the
    residuals, but people who are not on the map do not.
    """

    def __init__(
        self, field: DistanceField, unmapped: npt.NDArray[np.bool_], z_hit: float, z_rand: float, sigma_hit: float
    ) -> None:
        """Take a map and AMCL's parameters. `unmapped` marks cells of `field.table` outside the mapped area."""
        self._field, self._unmapped = field, unmapped
        self._z_hit, self._z_rand, self._sigma_hit = z_hit, z_rand, sigma_hit

    def residuals(self, beams: Beams, pose: Pose2) -> ScanResiduals | None:
        """Return the residuals of a scan taken at `pose`; None if the map explains none of its beams."""
        cells = self._field.endpoint_cells(np.array([pose]), beams.ends)[0]
        is_mapped = ~self._unmapped.take(cells, mode="clip")
        distances = self._field.table.take(cells, mode="clip")[is_mapped] / self._sigma_hit
        hit = self._z_hit * np.exp(-0.5 * np.square(distances, dtype=np.float64))
        if not len(hit) or not hit.any():
            return None
        explained = hit / (hit + self._z_rand / beams.range_max)
        return ScanResiduals(float(explained.mean()), float(np.mean(np.square(explained * distances))))


FIT_DISTANCE_M = 0.3
"""A beam fits the map if it ends closer than this to an obstacle."""
CLUSTER_RADIUS_M = 1.0
"""Particles that are all within this distance of their mean are one narrow cluster."""
SAMPLED_PARTICLES = 50
"""Number of particles at which beams are compared with the map."""
MAPPED_SHARE = 0.1, 0.8
"""Shares of the beams that end on the mapped area: up to the first, a scan is ignored; from the second on, it has its
full weight. A few beams that reach back over the edge of the map fit one of its walls from many poses."""
MIN_PARTICLE_SHARE = 0.5
"""Share of the particles for which a beam must end on the mapped area to be used."""
_UNMAPPED, _FITS, _MISSES = 0, 1, 2
"""Classes of cells for the endpoint of a beam."""


class ScanWeight(NamedTuple):
    """Weight of a scan.

    exponent:       exponent of its likelihood, 0 … 1
    fitting_share:  share of the beams that fit the map, of those that end on the mapped area
    used_hits:      mask (m,) of the beams with a hit that are used; None for all
    """

    exponent: float
    fitting_share: float
    used_hits: npt.NDArray[np.bool_] | None


class MapTrust:
    """Determines the weight of each scan, which is small if the map does not agree with it.

    If the particles are one narrow cluster, the pose is right, or the relocalization will find that it is wrong. Beams
    that do not fit then show that the map is outdated. The other beams may fit by chance and move the cluster. Outside
    the map, particles spread, and the first beams that touch the map would attract them to a wrong pose. A scan of
    which few beams end on the mapped area is therefore ignored as well.
    """

    def __init__(self, field: DistanceField, unmapped: npt.NDArray[np.bool_], zero: float, full: float) -> None:
        """Classify the cells of a map. `unmapped`, in the order of `field.table`, marks cells outside the mapped area.

        A scan is ignored if at most the share `zero` of its beams fits. From the share `full` on, it counts fully.
        """
        self._field, self._zero, self._full = field, zero, full
        mapped = np.where(field.table < FIT_DISTANCE_M, _FITS, _MISSES)
        self._class_table = np.where(unmapped, _UNMAPPED, mapped).astype(np.uint8)

    def weight(self, particles: Particles, beams: Beams) -> ScanWeight:
        """Return the weight of a scan.

        For a narrow cluster, only beams that end on the mapped area for most particles are used. The others would move
        the particles into the map or out of it, because their likelihood is between that of a hit and that of a miss.
        """
        classes = self._classes(self._endpoint_cells(particles.poses, beams))
        known_share, fitting = _shares(classes)
        exponent = _ramp(known_share, *MAPPED_SHARE)
        if not particles.are_within(CLUSTER_RADIUS_M):
            return ScanWeight(exponent, fitting, None)
        used = None
        if known_share < 1.0:
            used = np.add.reduce(classes != _UNMAPPED, axis=0) > MIN_PARTICLE_SHARE * len(classes)
        return ScanWeight(exponent * _ramp(fitting, self._zero, self._full), fitting, used)

    def fitting_share(self, poses: Array, ends: Plane, min_mapped: float) -> float | None:
        """Return the share of the beams that fit at `poses` (n, 3), of those that end on the mapped area.

        None if fewer than the share `min_mapped` end there.
        """
        known_share, fitting = _shares(self._classes(self._field.endpoint_cells(poses, ends)))
        return fitting if known_share and known_share >= min_mapped else None

    def _endpoint_cells(self, poses: Array, beams: Beams) -> Cells:
        """Return the cells of the endpoints for some of the `poses`. For few poses, all are cached anyway."""
        step = -(-len(poses) // SAMPLED_PARTICLES)
        if len(poses) <= BLOCK_POSES:
            return beams.cells(self._field, poses)[::step]
        return self._field.endpoint_cells(poses[::step], beams.ends)

    def _classes(self, cells: Cells) -> npt.NDArray[np.uint8]:
        classes: npt.NDArray[np.uint8] = self._class_table.take(cells, mode="wrap")
        return classes


def _shares(classes: npt.NDArray[np.uint8]) -> tuple[float, float]:
    """Return the share of beams that end on the mapped area, and the share of these that fit."""
    mapped, fitting = int(np.count_nonzero(classes)), int(np.count_nonzero(classes == _FITS))
    return mapped / max(classes.size, 1), fitting / max(mapped, 1)


def _ramp(value: float, none: float, full: float) -> float:
    """Return 0 up to `none`, 1 from `full` on, and linear values in between."""
    return 1.0 if value >= full else max(0.0, (value - none) / (full - none))
