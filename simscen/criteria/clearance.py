"""`clearance`: how near the robot came to things."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from simscen.core.verdict import Finding
from simscen.criteria.base import Criterion
from simscen.criteria.bounds import BrokenTrace, at_least, undecided
from simscen.spec.base import Spec
from simscen.spec.quantities import NonNegativeLength

if TYPE_CHECKING:
    from simscen.core.case import Case
    from simscen.core.trace import Trace


class Clearance(Spec, Criterion):
    """The robot kept its distance.

    What is measured: the smallest true distance between the robot's hull and the surface of anything solid, over the
        whole run.
    When it fails: it is below `min`.
    Why this: a near miss is a collision with better luck; the margin shows it long before the first contact.
    Source: bench-mr's ClearingMetric, but from the true geometry, not from a map or a scan.

    Example: `clearance: {min: 0.1 m}`
    """

    min: NonNegativeLength
    """Metres."""

    def judge(self, trace: Trace, case: Case) -> list[Finding]:
        """The tightest moment. Free space beyond the searched range may be infinite; nan may not."""
        distances = trace.clearance.values[:, 0]
        if not len(distances):
            return [undecided("clearance", "no clearance was recorded", f"≥ {self.min:.2f} m")]
        if np.isnan(distances).any():
            tick = int(trace.clearance.ticks[int(np.argmax(np.isnan(distances)))])
            raise BrokenTrace(f"the clearance is not a number at t = {trace.seconds(tick):.2f} s")
        k = int(np.argmin(distances))
        at = (trace, int(trace.clearance.ticks[k]))
        return [at_least("clearance", float(distances[k]), self.min, "m", at=at)]
