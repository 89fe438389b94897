"""`reversed_length`: how far the robot drove backwards."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import numpy as np

from simscen.plugin import Evidence, Measure, Spec, Speed

if TYPE_CHECKING:
    from simscen.plugin import Case, Trace


class ReversedLength(Spec, Measure):
    """The way that the robot truly drove backwards.

    Example: `metrics: [{reversed_length: {}}]`
    """

    unit: ClassVar[str] = "m"
    slower_than: Speed = 0.0
    """What counts as backwards: a speed along its own nose below this."""

    @property
    def evidence(self) -> frozenset[Evidence]:
        """The true velocity."""
        return frozenset({Evidence.VELOCITY})

    def measure(self, trace: Trace, case: Case) -> float | str:
        """Speed times time, sample by sample; a text says why there is no number."""
        velocity = trace.velocity
        if not len(velocity):
            return "the true velocity was not recorded"
        ahead, lasts = velocity.values[:, 0], np.diff(np.append(velocity.ticks, trace.end)) / trace.tick_rate
        return float(-(ahead * lasts)[ahead < min(self.slower_than, 0.0)].sum())
