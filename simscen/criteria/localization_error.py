"""`localization_error`: how well the robot knows where it is."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from pydantic import model_validator

from simscen.core.geometry import Array
from simscen.core.records.evidence import POSITION, Evidence
from simscen.core.records.verdict import Finding
from simscen.criteria.base import Criterion
from simscen.criteria.findings import at_most, undecided
from simscen.criteria.timeline import has_ended
from simscen.criteria.trace_signals.ground_truth import pose_error
from simscen.spec.base import Spec
from simscen.spec.quantities import Duration, PositiveAngle, PositiveLength

if TYPE_CHECKING:
    from simscen.core.records.case import Case
    from simscen.core.records.trace import Samples, Trace


class LocalizationError(Spec, Criterion):
    """The robot was where it believed to be.

    What is measured: the distance between believed and true position (and the heading error) whenever the robot
        publishes its belief, and all the time while its newest belief is over 1 s old; without any alignment.
    When it fails: the largest, the root mean square or the last error exceeds its bound.
    Why this: goals can be reached by luck with a belief half a meter off, until a shelf stands in that half meter.
    Source: evo's APE (metrics.py) and Beluga's benchmarks; alignment would forgive the very error we look for.

    Example: `localization_error: {max: 0.3 m, rmse: 0.1 m, after: 5 s}`
    """

    max: PositiveLength | None = None
    """Never further off than this."""
    rmse: PositiveLength | None = None
    """Root mean square of the distance."""
    final: PositiveLength | None = None
    """At the end of the run."""
    max_yaw: PositiveAngle | None = None
    """Heading never further off than this."""
    after: Duration = 0.0
    """Only from this simulated time on: time to settle in."""

    @model_validator(mode="after")
    def _some_bound(self) -> LocalizationError:
        if self.max is None and self.rmse is None and self.final is None and self.max_yaw is None:
            raise ValueError("expected at least one of: max, rmse, final, max_yaw")
        return self

    @property
    def horizon(self) -> float:
        """When judging begins."""
        return self.after

    @property
    def evidence(self) -> frozenset[Evidence]:
        """What a log must hold for it to be decided."""
        return POSITION | {Evidence.BELIEF}

    def judge(self, trace: Trace, case: Case) -> list[Finding]:
        """One finding for each bound that is given."""
        error = pose_error(trace)
        if not len(error):
            return [undecided("localization_error", "the robot never said where it believes to be")]
        counts = error.ticks >= self.after * trace.tick_rate
        if not counts.any():
            last = trace.seconds(int(error.ticks[-1]))
            because = f"the last belief is from t = {last:.2f} s, but judging begins at {self.after:.2f} s"
            return [undecided("localization_error", because)]
        return self._bounds(trace, type(error)(error.ticks[counts], error.values[counts]))

    def _bounds(self, trace: Trace, error: Samples) -> list[Finding]:
        off, turned = error.values.T
        findings = []
        if self.max is not None:
            findings.append(_worst(trace, error, off, "localization_error", self.max, "m"))
        if self.rmse is not None:
            rmse = float(np.sqrt(np.mean(off**2)))
            bound = at_most("localization_error rmse", rmse, self.rmse, "m", context="(not aligned)")
            findings.append(_of_a_whole_run(trace, bound))
        if self.final is not None:
            at = (trace, int(error.ticks[-1]))
            bound = at_most("localization_error final", float(off[-1]), self.final, "m", at=at)
            findings.append(_of_a_whole_run(trace, bound))
        if self.max_yaw is not None:
            findings.append(_worst(trace, error, turned, "localization_error yaw", self.max_yaw, "rad"))
        return findings


def _of_a_whole_run(trace: Trace, finding: Finding) -> Finding:
    """A log that was cut off might have ended better than it was until then."""
    if has_ended(trace):
        return finding
    return undecided(finding.what, f"{finding.measured} so far", finding.limit)


def _worst(trace: Trace, error: Samples, values: Array, what: str, limit: float, unit: str) -> Finding:
    k = int(np.argmax(values))
    return at_most(what, float(values[k]), limit, unit, at=(trace, int(error.ticks[k])))
