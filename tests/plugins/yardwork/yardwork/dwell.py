"""`dwell`: the longest uninterrupted stay of the robot in a region."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from simscen.plugin import (
    Criterion,
    Evidence,
    Finding,
    Pose2,
    PositiveDuration,
    RegionName,
    Spec,
    at_most,
    distance_to_polygon,
    truth,
    undecided,
)

if TYPE_CHECKING:
    from simscen.plugin import Case, Trace


class Dwell(Spec, Criterion):
    """The robot leaves a region again soon enough.

    What is measured: the longest time that its center stays in the region without a break.
    When it fails: that is longer than `max`.
    Why this: a robot that waits in a doorway or before a fire door blocks everybody, and reaches its goal all the same.

    Example: `dwell: {region: doorway, max: 5 s}`
    """

    region: RegionName
    """By name."""
    max: PositiveDuration
    """How long it may stay."""

    @property
    def evidence(self) -> frozenset[Evidence]:
        """The true way, on the map."""
        return frozenset({Evidence.TRUTH, Evidence.ALIGNMENT})

    def judge(self, trace: Trace, case: Case) -> list[Finding]:
        """The longest stay."""
        what, limit = f"dwell {self.region}", f"≤ {self.max:.2f} s"
        poses = truth(trace)
        if self.region not in case.regions or not len(poses):
            return [undecided(what, "the region or the robot's way was not recorded", limit)]
        inside = [distance_to_polygon(Pose2(*pose), case.regions[self.region]) <= 0 for pose in poses.values.tolist()]
        edges = np.diff(np.array([0, *inside, 0], dtype=np.int8))
        ticks = np.append(poses.ticks, trace.end)
        stays = list(zip(ticks[np.flatnonzero(edges == 1)], ticks[np.flatnonzero(edges == -1)], strict=True))
        longest, left = max(((int(end - begin), int(end)) for begin, end in stays), default=(0, 0))
        return [at_most(what, trace.seconds(longest), self.max, "s", at=(trace, left))]
