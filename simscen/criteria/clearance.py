"""The criteria `clearance` and `personal_space`: minimum distances from obstacles and from pedestrians."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import numpy as np

from simscen.core.records.verdict import POSITION_EVIDENCE, Evidence, Finding
from simscen.criteria.base import Criterion
from simscen.criteria.findings import MissingEvidence, at_least, undecided
from simscen.criteria.trace_signals.distances import INTIMATE_SPACE_M, pedestrian_gap
from simscen.criteria.trace_signals.ground_truth import clearance, speed
from simscen.criteria.trace_signals.sampling import sample_and_hold
from simscen.spec.base import Spec
from simscen.spec.quantities import NonNegativeLength

if TYPE_CHECKING:
    from simscen.core.records.case import Case
    from simscen.core.records.trace import Trace


SEARCH_MARGIN_M = 0.5
"""Distance beyond the bound up to which clearance is measured, so that a verdict can state the margin."""


class Clearance(Spec, Criterion):
    """The robot kept a minimum distance from everything solid.

    What is measured: the smallest true distance between the robot's hull and the surface of anything solid, over the
        whole run. The measuring range is 2 m, or `min` plus 0.5 m if this is more.
    When it fails: the distance is below `min`.
    Why this: a near miss can become a collision; the margin shows the risk before the first contact.
    Source: bench-mr's ClearingMetric, but computed from the true geometry, not from a map or a scan.

    Example: `clearance: {min: 0.1 m}`
    """

    min: NonNegativeLength
    """Smallest allowed distance in meters."""

    evidence: ClassVar[frozenset[Evidence]] = frozenset({Evidence.CLEARANCE})

    @property
    def clearance_range(self) -> float:
        """Distance in m around the robot up to which clearance must be measured."""
        return self.min + SEARCH_MARGIN_M

    def judge(self, trace: Trace, case: Case) -> list[Finding]:
        """Return the finding for the smallest clearance. Raises InvalidTrace if a clearance is nan."""
        distances = clearance(trace).values[:, 0]
        if not len(distances):
            return [undecided("clearance", "no clearance was recorded", f"≥ {self.min:.2f} m")]
        k = int(np.argmin(distances))
        if case.clearance_range <= distances[k] < self.min:
            because = (
                f"nothing was nearer than {case.clearance_range:.2f} m, and the clearance was not measured beyond that"
            )
            return [undecided("clearance", because, f"≥ {self.min:.2f} m")]
        at = (trace, int(trace.clearance.ticks[k]))
        return [at_least("clearance", float(distances[k]), self.min, "m", at=at)]


MIN_DRIVING_SPEED_M_S = 0.1
"""Speed that a robot must exceed to count as driving for `while_driving`."""


class PersonalSpace(Spec, Criterion):
    """The robot kept a minimum distance from pedestrians.

    What is measured: the smallest true gap between the robot's footprint and the body of a pedestrian, over the whole
        run.
    When it fails: the gap is below `min`.
    Why this: people feel threatened by a robot that passes close by, long before any contact. The default of 0.45 m is
        the border of Hall's intimate space.
    Source: Hall 1966; the space intrusions of HuNavSim and of Francis et al. 2023, with the gap between surfaces.

    Inconclusive if no pedestrian was present. With `while_driving`, also inconclusive if pedestrians were present only
    while the robot stood.

    Example: `personal_space: {min: 0.3 m, while_driving: true}`
    """

    min: NonNegativeLength = INTIMATE_SPACE_M
    """Smallest allowed gap in meters."""
    while_driving: bool = False
    """Check only while the robot drives at more than 0.1 m/s, because people may approach a standing robot."""

    @property
    def evidence(self) -> frozenset[Evidence]:
        """Evidence in the log that the criterion needs."""
        speed_needed = {Evidence.VELOCITY} if self.while_driving else set()
        return POSITION_EVIDENCE | {Evidence.OBJECTS, Evidence.FOOTPRINT, *speed_needed}

    def judge(self, trace: Trace, case: Case) -> list[Finding]:
        """Return the finding for the smallest gap."""
        limit = f"≥ {self.min:.2f} m"
        try:
            gaps = pedestrian_gap(trace, case)
            if self.while_driving:
                speeds = sample_and_hold(trace, speed(trace), "velocity")[:, 0]
                gaps = np.where(speeds > MIN_DRIVING_SPEED_M_S, gaps, np.inf)
        except MissingEvidence as reason:
            return [undecided("distance to people", str(reason), limit)]
        nearest = int(np.argmin(gaps))
        if np.isinf(gaps[nearest]):
            because = f"no pedestrian was present{' while the robot drove' * self.while_driving}"
            return [undecided("distance to people", because, limit)]
        at = (trace, int(trace.truth.ticks[nearest]))
        return [at_least("distance to people", float(gaps[nearest]), self.min, "m", at=at)]
