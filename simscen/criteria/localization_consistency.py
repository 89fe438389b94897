"""`localization_consistency`: whether the robot is as sure of its pose as it may be."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated

import numpy as np
from pydantic import Field

from simscen.core.records.trace import Samples
from simscen.core.records.verdict import POSITION, Evidence, Finding
from simscen.core.statistics import chi2_quantile, nees_mean_bounds
from simscen.criteria.base import Criterion
from simscen.criteria.findings import at_least, at_most, missed, undecided
from simscen.criteria.trace_signals.ground_truth import DIMENSIONS, nees_samples
from simscen.spec.base import Spec
from simscen.spec.quantities import Duration, PositiveDuration, Quantity

if TYPE_CHECKING:
    from simscen.core.records.case import Case
    from simscen.core.records.trace import Trace


class LocalizationConsistency(Spec, Criterion):
    """The robot's doubt about its pose fitted its error.

    What is measured: the normalized estimation error squared e' P⁻¹ e of the believed pose (x, y, wrapped heading) with
        its covariance P, every so often, averaged over the run; 3 when the covariance tells the truth.
    When it fails: the average is above what a consistent belief keeps with this probability (the robot is
        overconfident), or with `both_sides` below it; or a covariance is singular, as that of a particle set that has
        collapsed: it claims to know a direction exactly.
    Why this: a planner that trusts a covariance drives by it; a filter that is wrong and sure of it never recovers.
    Source: Bar-Shalom, Li, Kirubarajan 2001, section 5.4; filterpy's stats.NEES.

    The bounds are those of a mean of independent samples. Errors of one run are correlated, so `every` should be longer
    than they last; the strict test is over runs at fixed times, as `simscen bench nav` takes it.

    Example: `localization_consistency: {every: 5 s, after: 10 s}`
    """

    probability: Annotated[float, Field(ge=0.5, le=0.9999), Quantity("ratio")] = 0.95
    """With which a consistent belief passes."""
    every: PositiveDuration = 5.0
    """Seconds between two samples."""
    after: Duration = 0.0
    """Only from this simulated time on: time to settle in."""
    both_sides: bool = False
    """Is a belief that is less sure than it may be a failure, too?"""

    @property
    def horizon(self) -> float:
        """When judging begins."""
        return self.after

    @property
    def evidence(self) -> frozenset[Evidence]:
        """What a log must hold for it to be decided."""
        return POSITION | {Evidence.BELIEF, Evidence.COVARIANCE}

    def judge(self, trace: Trace, case: Case) -> list[Finding]:
        """Return findings for the average and its upper bound, and with `both_sides` also for its lower bound."""
        samples = self._sampled(trace)
        if samples is None:
            return [undecided("localization_consistency", "the belief has no covariance")]
        if not len(samples):
            return [undecided("localization_consistency", f"there is no belief after t = {self.after:.2f} s")]
        values = samples.values[:, 0]
        worst = int(np.argmax(values))
        at = (trace, int(samples.ticks[worst]))
        if math.isinf(values[worst]):
            return [missed("localization_consistency", "overconfident", "a covariance that is not singular", at)]
        low, high = self._bounds(len(values))
        mean, context = float(values.mean()), f"(mean of {len(values)} NEES, {DIMENSIONS} when consistent)"
        findings = [at_most("localization_consistency", mean, high, "", at=at, context=context)]
        if low is not None:
            findings.append(at_least("localization_consistency doubt", mean, low, "", context=context))
        return findings

    def _bounds(self, count: int) -> tuple[float | None, float]:
        if self.both_sides:
            return nees_mean_bounds(count, DIMENSIONS, self.probability)
        return None, chi2_quantile(self.probability, DIMENSIONS * count) / count

    def _sampled(self, trace: Trace) -> Samples | None:
        """Return the NEES sampled at regular times from `after` to the last belief."""
        every = nees_samples(trace)
        if not len(every):
            return None
        first, last = max(self.after * trace.tick_rate, int(every.ticks[0])), int(every.ticks[-1])
        times = np.arange(first, last + 1, self.every * trace.tick_rate).astype(np.int64)
        chosen = np.searchsorted(every.ticks, times, side="right") - 1
        return Samples(every.ticks[chosen], every.values[chosen])
