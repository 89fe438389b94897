"""How badly the map explains the beams that it explains at all."""

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from simscen.core.geometry import Pose2
from simscen.stack.localizers.beams import Beams
from simscen.stack.localizers.distance_field import DistanceField


class ScanResiduals(NamedTuple):
    """Of one scan: `fits`, the share of the beams that the map explains, and `squares`, the mean square of what they
    are off by, over the variance that was expected of a beam; the other beams count as off by nothing."""

    fits: float
    squares: float


class MapResiduals:
    """Compares the ends of beams with what the map shows next to them.

    A beam whose end is d from the nearest obstacle is one of those that hit it with probability hit / (hit + random),
    the two parts of its likelihood. So far it pulls the robot, and only so far does it say how far off the map is:
    people's legs do not, cupboards that were moved by a hand's breadth do.
    """

    def __init__(
        self, field: DistanceField, beyond: npt.NDArray[np.bool_], z_hit: float, z_rand: float, sigma_hit: float
    ) -> None:
        """Of beams that end `beyond` (flat, as the field's table) the map says nothing."""
        self._field, self._beyond = field, beyond
        self._z_hit, self._z_rand, self._sigma_hit = z_hit, z_rand, sigma_hit

    def of(self, beams: Beams, pose: Pose2) -> ScanResiduals | None:
        """That of a scan taken at `pose`; None where the map says nothing of any of its beams, or explains none."""
        cells = self._field.cells_seen(np.array([pose]), beams.ends)[0]
        away = self._field.table.take(cells, mode="clip")[~self._beyond.take(cells, mode="clip")] / self._sigma_hit
        hit = self._z_hit * np.exp(-0.5 * np.square(away, dtype=np.float64))
        if not len(hit) or not hit.any():
            return None
        explained = hit / (hit + self._z_rand / beams.range_max)
        return ScanResiduals(float(explained.mean()), float(np.mean(np.square(explained * away))))
