"""`keepout`: where the robot must not be."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from simscen.core.events import EventKind
from simscen.core.polygons import flaw
from simscen.core.separation import separation
from simscen.core.verdict import Finding
from simscen.criteria.base import Criterion
from simscen.criteria.bounds import BrokenTrace, at_least, undecided
from simscen.criteria.signals import Flags, truth
from simscen.spec.base import Spec
from simscen.spec.quantities import NonNegativeLength
from simscen.spec.references import RegionName

if TYPE_CHECKING:
    from simscen.core.case import Case
    from simscen.core.samples import Samples
    from simscen.core.trace import Trace
    from simscen.core.world import Polygon

FINE = 0.005
"""Metres to which the nearest moment between two samples is searched."""


class Keepout(Spec, Criterion):
    """The robot stayed out of a region, with its whole hull.

    What is measured: the smallest distance between the robot's footprint and the region over the whole run, where
        between two samples of the truth the robot moves straight; negative by how far it would have to be moved to be
        out again (out of the deepest convex piece, where one of the two is not convex).
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
        region = case.regions[self.region]
        wrong = flaw(region)
        if wrong:
            raise BrokenTrace(f"region `{self.region}` {wrong}, so nothing is inside or outside of it")
        distance, tick = _nearest(trace, poses, case, region)
        return [at_least(what, distance, self.distance, "m", at=(trace, tick))]


def _nearest(trace: Trace, poses: Samples, case: Case, region: Polygon) -> tuple[float, int]:
    """The smallest signed distance on the way, and its tick; being set down elsewhere is no way.

    While the robot moves by m (its furthest point does), a distance changes by no more than m: stretches that cannot
    lead nearer than the nearest known moment by FINE are left out, the others halved.
    """
    hull = case.footprint or ((0.0, 0.0),)
    reach = max(math.hypot(x, y) for x, y in hull)
    yaw = np.unwrap(poses.values[:, 2])
    states = np.column_stack((poses.values[:, :2], yaw, separation(poses.values, hull, region), poses.ticks))
    best = states[np.argmin(states[:, 3])]
    driven = ~_carried(trace, poses)
    begin, end = states[:-1][driven], states[1:][driven]
    while len(begin):
        moved = np.hypot(*(end - begin)[:, :2].T) + reach * np.abs(end[:, 2] - begin[:, 2])
        hopeful = (begin[:, 3] + end[:, 3] - moved) / 2 < best[3] - FINE
        begin, end = begin[hopeful], end[hopeful]
        middle = (begin + end) / 2
        middle[:, 3] = separation(middle[:, :3], hull, region)
        best = min((best, *middle), key=lambda state: float(state[3]))
        begin, end = np.vstack((begin, middle)), np.vstack((middle, end))
    return float(best[3]) - (0.0 if case.footprint else case.inscribed_radius), int(best[4])


def _carried(trace: Trace, poses: Samples) -> Flags:
    """Of each stretch between two samples, whether the robot was set down elsewhere in it."""
    placed = [event.tick for event in trace.of_kind(EventKind.ROBOT_PLACED)]
    carried = np.zeros(len(poses) + 1, dtype=bool)
    carried[np.searchsorted(poses.ticks, placed, side="right")] = True
    return carried[1:-1]
