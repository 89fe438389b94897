"""`stuck`: how long the robot got nowhere."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from simscen.core.records.evidence import Evidence
from simscen.core.records.verdict import Finding
from simscen.criteria.base import Criterion
from simscen.criteria.findings import at_most, undecided
from simscen.criteria.goal_outcomes import goal_outcomes
from simscen.criteria.trace_signals.ground_truth import truth
from simscen.spec.base import Spec
from simscen.spec.quantities import PositiveDuration, PositiveLength

if TYPE_CHECKING:
    from simscen.core.records.case import Case
    from simscen.core.records.trace import Samples, Trace


class Stuck(Spec, Criterion):
    """The robot got on while it had a goal.

    What is measured: the longest time in which it stayed within `radius` of where it was, while a goal was under way.
    When it fails: that is longer than `max`.
    Why this: a robot that spins and backs up in front of a cart for a minute and then arrives has passed every other
        criterion.
    Source: Nav2's SimpleProgressChecker, whose defaults these are; ScenarioRunner's ActorBlockedTest.

    Example: `stuck: {max: 10 s}`
    """

    max: PositiveDuration = 10.0
    """Seconds."""
    radius: PositiveLength = 0.5
    """Meters that count as getting on."""

    @property
    def evidence(self) -> frozenset[Evidence]:
        """What a log must hold for it to be decided."""
        return frozenset({Evidence.TRUTH, Evidence.NAVIGATION})

    def judge(self, trace: Trace, case: Case) -> list[Finding]:
        """The longest stay over all goals."""
        poses = truth(trace)
        ways = [
            (outcome.accepted, trace.end if outcome.end is None else outcome.end.tick)
            for outcome in goal_outcomes(trace, case)
            if outcome.accepted is not None
        ]
        stays = [stay for start, end in ways for stay in _stays(poses, start, end, self.radius)]
        if not stays:
            return [undecided("stuck", "no goal was ever under way", f"≤ {self.max:.2f} s")]
        longest, tick = max(stays, key=lambda stay: (stay[0], -stay[1]))
        detail = [f"from t = {trace.seconds(tick - longest):.2f} s on it stayed within {self.radius:.2f} m"]
        return [at_most("stuck", trace.seconds(longest), self.max, "s", at=(trace, tick), detail=detail)]


def _stays(poses: Samples, start: int, end: int, radius: float) -> list[tuple[int, int]]:
    """(ticks it lasted, tick it ended) of each stay between `start` and `end`, as a progress checker sees them."""
    first, last = np.searchsorted(poses.ticks, (start, end + 1), side="left").tolist()
    if first == last:
        return []
    xs, ys, ticks = poses.values[:, 0].tolist(), poses.values[:, 1].tolist(), poses.ticks.tolist()
    stays, base, since = [], first, start
    for k in range(first, last):
        if math.hypot(xs[k] - xs[base], ys[k] - ys[base]) > radius:
            stays.append((ticks[k] - since, ticks[k]))
            base, since = k, ticks[k]
    return [*stays, (end - since, end)]
