"""The criterion `smoothness`: bounds on acceleration, jerk, SPARC, and LDLJ."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator

from simscen.core.records.verdict import Evidence, Finding
from simscen.criteria.base import Criterion
from simscen.criteria.findings import MissingEvidence, at_least, at_most, if_complete, undecided
from simscen.criteria.trace_signals.catalog import SignalName, read_signal
from simscen.criteria.trace_signals.ground_truth import speed
from simscen.criteria.trace_signals.sparc_ldlj import MIN_MOVING_SPEED_M_S, evenly_sampled_speed, ldlj, sparc
from simscen.spec.base import Spec
from simscen.spec.quantities import PositiveAcceleration, PositiveJerk

if TYPE_CHECKING:
    from simscen.core.records.case import Case
    from simscen.core.records.trace import Trace


class Smoothness(Spec, Criterion):
    """The robot drove smoothly.

    What is measured: four quantities of the true speed over ground of the whole run. Acceleration is the absolute
        difference of two samples, divided by the time step. Jerk is the absolute second difference, divided by the
        square of the time step. SPARC (spectral arc length; 0 is perfectly smooth) and LDLJ (log dimensionless jerk;
        larger is smoother) are dimensionless.
    When it fails: the largest acceleration, the largest jerk, or the mean jerk is above its bound, or SPARC or LDLJ is
        below its bound.
    Why this: jerk makes cargo fall over and is uncomfortable. A robot with an oscillating controller reaches its goals,
        but wears out its gears.
    Source: Balasubramanian et al. 2015 and the authors' code for SPARC and LDLJ. HuNavSim and Arena also report
        jerk: HuNavSim as a first difference, Arena without the time step.

    SPARC is sensitive to slow oscillation, LDLJ to stops. SPARC and LDLJ depend on the duration of the drive: compare
    only runs of the same drive. SPARC and LDLJ are inconclusive if the robot never moved.

    Example: `smoothness: {max_acceleration: 1 m/s^2, max_jerk: 60 m/s^3}`
    """

    max_acceleration: PositiveAcceleration | None = None
    """Maximum acceleration or deceleration over ground in m/s²."""
    max_jerk: PositiveJerk | None = None
    """Maximum jerk in m/s³."""
    max_mean_jerk: PositiveJerk | None = None
    """Maximum mean of the absolute jerk in m/s³."""
    min_sparc: Annotated[float, Field(lt=0, ge=-1000)] | None = None
    """Minimum spectral arc length; a straight drive at one speed has -2.1 to -2.4."""
    min_ldlj: Annotated[float, Field(ge=-1000, le=1000)] | None = None
    """Minimum log dimensionless jerk."""

    @model_validator(mode="after")
    def _check_bounds(self) -> Smoothness:
        if not self.model_dump(exclude_none=True):
            raise ValueError(f"expected at least one of: {', '.join(type(self).model_fields)}")
        return self

    evidence: ClassVar[frozenset[Evidence]] = frozenset({Evidence.TRUTH, Evidence.VELOCITY})

    def judge(self, trace: Trace, case: Case) -> list[Finding]:
        """Return one finding for each given bound."""
        findings = []
        if self.max_acceleration is not None:
            findings.append(_judge_largest(trace, case, "acceleration", self.max_acceleration, "m/s^2"))
        if self.max_jerk is not None:
            findings.append(_judge_largest(trace, case, "jerk", self.max_jerk, "m/s^3"))
        if self.max_mean_jerk is not None:
            findings.append(_judge_mean_jerk(trace, case, self.max_mean_jerk))
        if self.min_sparc is not None:
            findings.append(_judge_sparc_or_ldlj(trace, "sparc", self.min_sparc))
        if self.min_ldlj is not None:
            findings.append(_judge_sparc_or_ldlj(trace, "ldlj", self.min_ldlj))
        return findings


def _judge_largest(trace: Trace, case: Case, name: SignalName, limit: float, unit: str) -> Finding:
    """Return the finding for the largest magnitude of the signal `name`."""
    try:
        values = read_signal(name, trace, case, {})
    except MissingEvidence as reason:
        return undecided(name, str(reason), f"≤ {limit:g} {unit}")
    k = int(np.argmax(np.abs(values)))
    return at_most(name, float(abs(values[k])), limit, unit, at=(trace, int(trace.truth.ticks[k])))


def _judge_mean_jerk(trace: Trace, case: Case, limit: float) -> Finding:
    try:
        values = read_signal("jerk", trace, case, {})
    except MissingEvidence as reason:
        return undecided("mean jerk", str(reason), f"≤ {limit:g} m/s^3")
    return if_complete(trace, at_most("mean jerk", float(values.mean()), limit, "m/s^3"))


def _judge_sparc_or_ldlj(trace: Trace, name: Literal["sparc", "ldlj"], limit: float) -> Finding:
    speeds = speed(trace)
    if not len(speeds) or speeds.values.max() < MIN_MOVING_SPEED_M_S:
        return undecided(name, "the robot never moved", f"≥ {limit:g}")
    try:
        even_speeds, rate = evenly_sampled_speed(trace)
    except MissingEvidence as reason:
        return undecided(name, str(reason), f"≥ {limit:g}")
    value = (sparc if name == "sparc" else ldlj)(even_speeds, rate)
    if value is None:
        return undecided(name, "the speed never changed", f"≥ {limit:g}")
    return if_complete(trace, at_least(name, value, limit, ""))
