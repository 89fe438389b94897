"""Residuals of a scan: the distances of its endpoints from the obstacles of the map."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Pose2
from simscen.stack.localizers.beams import Beams
from simscen.stack.localizers.distance_field import DistanceField


class ScanResiduals(NamedTuple):
    """Residuals of one scan.

    explained:    share of the beams that the map explains
    mean_square:  of the distances of these beams' endpoints from obstacles, over `sigma_hit`²; others count as 0
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
        self, field: DistanceField, beyond: npt.NDArray[np.bool_], z_hit: float, z_rand: float, sigma_hit: float
    ) -> None:
        """Create residuals of a map. `beyond` (flat, as the field's table) marks cells outside the mapped area."""
        self._field, self._beyond = field, beyond
        self._z_hit, self._z_rand, self._sigma_hit = z_hit, z_rand, sigma_hit

    def residuals(self, beams: Beams, pose: Pose2) -> ScanResiduals | None:
        """Return the residuals of a scan taken at `pose`; None if the map explains none of its beams."""
        cells = self._field.endpoint_cells(np.array([pose]), beams.ends)[0]
        distances = self._field.table.take(cells, mode="clip")[~self._beyond.take(cells, mode="clip")] / self._sigma_hit
        hit = self._z_hit * np.exp(-0.5 * np.square(distances, dtype=np.float64))
        if not len(hit) or not hit.any():
            return None
        explained = hit / (hit + self._z_rand / beams.range_max)
        return ScanResiduals(float(explained.mean()), float(np.mean(np.square(explained * distances))))
