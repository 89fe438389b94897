"""`keepout`: where the robot must not be."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from simscen.core.geometry import Array
from simscen.core.verdict import Finding
from simscen.criteria.base import Criterion
from simscen.criteria.bounds import at_least, undecided
from simscen.criteria.signals import truth
from simscen.spec.base import Spec
from simscen.spec.quantities import NonNegativeLength
from simscen.spec.references import RegionName

if TYPE_CHECKING:
    from simscen.core.case import Case
    from simscen.core.trace import Trace


class Keepout(Spec, Criterion):
    """The robot stayed out of a region, with its whole hull.

    What is measured: the smallest distance between the robot's footprint and the region over the whole run; negative
        by how deep a corner of one is inside the other.
    When it fails: it is below `distance`.
    Why this: a keepout filter in a costmap is advice to a planner; recoveries and controllers leave the plan.
    Source: Nav2's keepout filter tutorial.

    Example: `keepout: {region: wet floor, distance: 10 cm}`
    """

    region: RegionName
    """By name."""
    distance: NonNegativeLength = 0.0
    """How far to stay away from it."""

    def judge(self, trace: Trace, case: Case) -> list[Finding]:
        """The nearest moment."""
        what, limit = f"keepout {self.region}", f"≥ {self.distance:.2f} m"
        if self.region not in case.regions:
            return [undecided(what, f"the world has no region `{self.region}`", limit)]
        poses = truth(trace)
        if not len(poses):
            return [undecided(what, "the robot's way was not recorded", limit)]
        region = np.array(case.regions[self.region], dtype=np.float64)
        distances = _distances(poses.values, np.array(case.footprint or [(0.0, 0.0)], dtype=np.float64), region)
        k = int(np.argmin(distances))
        at = (trace, int(poses.ticks[k]))
        return [at_least(what, float(distances[k]), self.distance, "m", at=at)]


def _distances(poses: Array, hull: Array, region: Array) -> Array:
    """Signed distance (n,) between `hull` (h, 2) carried along `poses` (n, 3) and `region` (r, 2), both filled.

    The nearest points of two polygons that do not overlap are a corner of one and an edge of the other.
    """
    c, s = np.cos(poses[:, 2])[:, np.newaxis], np.sin(poses[:, 2])[:, np.newaxis]
    corners = np.stack((c * hull[:, 0] - s * hull[:, 1], s * hull[:, 0] + c * hull[:, 1]), axis=2)
    corners += poses[:, np.newaxis, :2]
    apart = region[np.newaxis] - poses[:, np.newaxis, :2]
    seen = np.stack((c * apart[..., 0] + s * apart[..., 1], c * apart[..., 1] - s * apart[..., 0]), axis=2)
    nearest: Array = np.minimum(_signed(corners, region).min(axis=1), _signed(seen, hull).min(axis=1))
    return nearest


def _signed(points: Array, polygon: Array) -> Array:
    """Distance (n, k) of points (n, k, 2) to the border of a polygon (m, 2), negative inside it."""
    ends = np.roll(polygon, -1, axis=0)
    along = ends - polygon
    squared = np.maximum((along**2).sum(axis=1), 1e-300)
    offset = points[:, :, np.newaxis] - polygon
    share = np.clip((offset * along).sum(axis=3) / squared, 0.0, 1.0)
    distance = np.hypot(*np.moveaxis(offset - share[..., np.newaxis] * along, 3, 0)).min(axis=2)
    x, y = points[..., np.newaxis, 0], points[..., np.newaxis, 1]
    spans = (polygon[:, 1] > y) != (ends[:, 1] > y)
    rise = np.where(along[:, 1] == 0, 1.0, along[:, 1])
    crossings = spans & (x < polygon[:, 0] + (y - polygon[:, 1]) / rise * along[:, 0])
    inside = crossings.sum(axis=2) % 2 == 1
    signed: Array = np.where(inside, -distance, distance)
    return signed
