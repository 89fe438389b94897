"""The criterion `keepout`: the robot did not enter a region or the occupied cells of a mask."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from pydantic import model_validator

from simscen.core.geometry.polygon_separation import POINT, separation, separation_from_boxes
from simscen.core.geometry.polygons import polygon_defect
from simscen.core.records.verdict import POSITION_EVIDENCE, Evidence, Finding
from simscen.criteria.base import Criterion
from simscen.criteria.findings import InvalidTrace, at_least, undecided
from simscen.criteria.timeline import NEVER_ENABLED, clip_samples, enabled_spans
from simscen.criteria.trace_signals.ground_truth import teleport_samples, truth
from simscen.spec.base import Spec
from simscen.spec.places import MaskFile, RegionName
from simscen.spec.quantities import Duration, NonNegativeLength

if TYPE_CHECKING:
    from collections.abc import Callable

    from simscen.core.geometry import Array
    from simscen.core.records.case import Case
    from simscen.core.records.trace import Samples, Trace

    DistanceFunction = Callable[[Array], Array]

ACCURACY_M = 0.005
"""Accuracy with which the smallest distance is computed."""


class Keepout(Spec, Criterion):
    """No part of the robot entered a region, or the occupied cells of a keepout mask.

    What is measured: the smallest distance between the robot's footprint and the region or the occupied cells, over the
        whole run. Between two samples of the true pose, motion is assumed to be straight. A negative distance is the
        depth of an overlap: the shortest way by which the robot could be moved out. Concave shapes are divided into
        convex pieces, and masks into rectangles; the deepest overlap of two pieces counts.
    When it fails: the distance is below `distance`.
    Why this: a keepout filter affects the costmap of the planner, but recoveries and controllers can leave the plan.
    Source: Nav2's keepout filter tutorial.

    Inconclusive if no cell of the mask is occupied. With `while_on`, also inconclusive if no event switched the zone,
    or if the zone was never on for longer than `grace`.

    Example: `keepout: {region: wet floor, distance: 10 cm}`
    """

    region: RegionName | None = None
    """Name of the region."""
    mask: MaskFile | None = None
    """Map YAML file of a filter mask, relative to this file, instead of a region. Only occupied cells are forbidden.

    The stack receives the mask only if `stack.keepout_mask` names it as well."""
    distance: NonNegativeLength = 0.0
    """Minimum distance from the region or the occupied cells."""
    while_on: bool = False
    """Check only while the zone is enabled by the action `keepout`; default: the whole run."""
    grace: Duration = 0.0
    """Time that the robot has for leaving the zone after it was enabled; only with `while_on`."""

    @model_validator(mode="after")
    def _check_region_or_mask(self) -> Keepout:
        if (self.region is None) == (self.mask is None):
            raise ValueError("expected either region or mask")
        if self.grace and not self.while_on:
            raise ValueError("grace only applies to a zone that is switched on; add `while_on: true`")
        return self

    @property
    def evidence(self) -> frozenset[Evidence]:
        """Evidence in the log that the criterion needs."""
        disturbances = {Evidence.DISTURBANCES} if self.while_on else set()
        return POSITION_EVIDENCE | {Evidence.FOOTPRINT, *disturbances}

    def judge(self, trace: Trace, case: Case) -> list[Finding]:
        """Return the finding for the smallest distance."""
        what, limit = f"keepout {self.region or self.mask}", f"≥ {self.distance:.2f} m"
        distances = self._distance_function(case)
        if isinstance(distances, str):
            return [undecided(what, distances, limit)]
        poses = truth(trace)
        if not len(poses):
            return [undecided(what, "the robot's path was not recorded", limit)]
        if not self.while_on:
            distance, tick = _smallest_distance(trace, poses, case, distances)
            return [at_least(what, distance, self.distance, "m", at=(trace, tick))]
        paths = [clip_samples(poses, *span) for span in enabled_spans(trace, "keepout", self.region, self.grace)]
        found = [_smallest_distance(trace, path, case, distances) for path in paths if len(path)]
        if not found:
            return [undecided(what, NEVER_ENABLED, limit)]
        distance, tick = min(found)
        return [at_least(what, distance, self.distance, "m", at=(trace, tick), context="while the zone was on")]

    def _distance_function(self, case: Case) -> DistanceFunction | str:
        """Return a function from poses (n, 3) to signed distances (n,) of the footprint from the region or mask.

        If the world has no such region, or the log no such mask with occupied cells, return the reason as text.
        """
        hull = case.footprint or POINT
        if self.region is None:
            mask = case.masks.get(self.mask or "")
            if mask is None:
                return f"the log has no mask `{self.mask}`"
            boxes = mask.occupied_boxes
            if not len(boxes):
                return f"no cell of `{self.mask}` is occupied"
            return lambda poses: separation_from_boxes(mask.to_mask_frame(poses), hull, boxes)
        if self.region not in case.regions:
            return f"the world has no region `{self.region}`"
        region = case.regions[self.region]
        defect = polygon_defect(region)
        if defect:
            raise InvalidTrace(f"region `{self.region}` {defect}, so it has no inside and outside")
        return lambda poses: separation(poses, hull, region)


def _smallest_distance(trace: Trace, poses: Samples, case: Case, distances: DistanceFunction) -> tuple[float, int]:
    """Return the smallest signed distance in m along the driven path, and its tick. Teleportation does not count.

    An interval between two samples is bisected as long as it may contain a distance that is smaller by more than
    ACCURACY_M than the smallest one found. An unknown footprint is replaced by the inscribed circle.
    """
    # While no point of the robot moves by more than s, the distance changes by at most s.
    radius = max(math.hypot(x, y) for x, y in case.footprint or POINT)
    yaw = np.unwrap(poses.values[:, 2])
    states = np.column_stack((poses.values[:, :2], yaw, distances(poses.values), poses.ticks))  # x, y, yaw, d, tick
    best = states[np.argmin(states[:, 3])]
    teleported = np.zeros(len(poses) + 1, dtype=bool)
    teleported[teleport_samples(trace, poses.ticks)] = True
    driven = ~teleported[1:-1]  # the intervals between two samples in which the robot was not teleported
    begin, end = states[:-1][driven], states[1:][driven]
    while len(begin):
        moved = np.hypot(*(end - begin)[:, :2].T) + radius * np.abs(end[:, 2] - begin[:, 2])
        may_improve = (begin[:, 3] + end[:, 3] - moved) / 2 < best[3] - ACCURACY_M
        begin, end = begin[may_improve], end[may_improve]
        middle = (begin + end) / 2
        middle[:, 3] = distances(middle[:, :3])
        best = min((best, *middle), key=lambda state: float(state[3]))
        begin, end = np.vstack((begin, middle)), np.vstack((middle, end))
    return float(best[3]) - (0.0 if case.footprint else case.inscribed_radius), int(best[4])
