"""`clearance`: how near the robot came to things."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from simscen.core.records.evidence import Evidence
from simscen.core.records.verdict import Finding
from simscen.criteria.base import Criterion
from simscen.criteria.findings import at_least, undecided
from simscen.criteria.trace_signals.ground_truth import clearance
from simscen.spec.base import Spec
from simscen.spec.quantities import NonNegativeLength

if TYPE_CHECKING:
    from simscen.core.records.case import Case
    from simscen.core.records.trace import Trace

SEARCH_MARGIN_M = 0.5
"""Meters beyond its bound."""


class Clearance(Spec, Criterion):
    """The robot kept its distance.

    What is measured: the smallest true distance between the robot's hull and the surface of anything solid, over the
        whole run. It is searched 2 m around the robot, and further where a bound asks for it.
    When it fails: it is below `min`.
    Why this: a near miss is a collision with better luck; the margin shows it long before the first contact.
    Source: bench-mr's ClearingMetric, but from the true geometry, not from a map or a scan.

    Example: `clearance: {min: 0.1 m}`
    """

    min: NonNegativeLength
    """Meters."""

    @property
    def clearance_range(self) -> float:
        """Its bound and a little more, so that a margin is left to be seen."""
        return self.min + SEARCH_MARGIN_M

    @property
    def evidence(self) -> frozenset[Evidence]:
        """What a log must hold for it to be decided."""
        return frozenset({Evidence.CLEARANCE})

    def judge(self, trace: Trace, case: Case) -> list[Finding]:
        """The tightest moment. Space that is free as far as was searched may be infinite; nan may not."""
        distances = clearance(trace).values[:, 0]
        if not len(distances):
            return [undecided("clearance", "no clearance was recorded", f"≥ {self.min:.2f} m")]
        k = int(np.argmin(distances))
        if case.clearance_range <= distances[k] < self.min:
            because = f"nothing was nearer than {case.clearance_range:.2f} m, and further was not searched"
            return [undecided("clearance", because, f"≥ {self.min:.2f} m")]
        at = (trace, int(trace.clearance.ticks[k]))
        return [at_least("clearance", float(distances[k]), self.min, "m", at=at)]
