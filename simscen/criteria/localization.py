"""The criteria `localization_error`, `relocalized_within`, and `localization_consistency`."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, ClassVar

import numpy as np
from pydantic import Field, model_validator

from simscen.core.geometry import Array
from simscen.core.records.verdict import POSITION_EVIDENCE, Evidence, Finding, Status
from simscen.core.statistics import chi2_quantile, nees_mean_bounds
from simscen.criteria.base import Criterion
from simscen.criteria.findings import at_least, at_most, if_complete, missed, undecided
from simscen.criteria.timeline import Span, end_reason, first_sustained, never_started, spans
from simscen.criteria.trace_signals.estimation_errors import (
    BELIEF_TIMEOUT_S,
    DIMENSIONS,
    NO_BELIEF,
    error_weights,
    nees_samples,
    pose_error,
    root_mean_square,
)
from simscen.spec.base import Spec
from simscen.spec.places import DisturbanceName
from simscen.spec.quantities import Duration, PositiveAngle, PositiveDuration, PositiveLength, Quantity

if TYPE_CHECKING:
    from simscen.core.records.case import Case
    from simscen.core.records.trace import Samples, Trace


class LocalizationError(Spec, Criterion):
    """The localization error of the robot stayed small.

    What is measured: the distance between the estimated and the true position, and the heading error, whenever the
        stack publishes an estimated pose (belief), and continuously while the newest belief is over 1 s old. In the
        root mean square, each belief counts once; while the newest belief is old, the error counts as often as beliefs
        at the usual rate would. The trajectories are not aligned, because an alignment would hide the error.
    When it fails: the largest error, the root mean square, or the last error exceeds its bound. If the first belief is
        over 1 s later than `after`, only `final` can pass.
    Why this: a robot whose error is half a meter may reach goals in open space, but not near obstacles.
    Source: evo's APE (metrics.py) and Beluga's benchmarks.

    Example: `localization_error: {max: 0.3 m, rmse: 0.1 m, after: 5 s}`
    """

    max: PositiveLength | None = None
    """Bound on the largest distance."""
    rmse: PositiveLength | None = None
    """Bound on the root mean square of the distance."""
    final: PositiveLength | None = None
    """Bound on the last measured distance, at most 1 s before the end of the run."""
    max_yaw: PositiveAngle | None = None
    """Bound on the largest heading error."""
    after: Duration = 0.0
    """Simulated time at which the evaluation begins, for example after the particle filter has converged."""

    @model_validator(mode="after")
    def _check_bounds(self) -> LocalizationError:
        if self.max is None and self.rmse is None and self.final is None and self.max_yaw is None:
            raise ValueError("expected at least one of: max, rmse, final, max_yaw")
        return self

    @property
    def horizon(self) -> float:
        """Simulated time in s before which the criterion cannot pass."""
        return self.after

    evidence: ClassVar[frozenset[Evidence]] = POSITION_EVIDENCE | {Evidence.BELIEF}

    def judge(self, trace: Trace, case: Case) -> list[Finding]:
        """Return one finding for each given bound."""
        error = pose_error(trace)
        if not len(error):
            return [undecided("localization_error", NO_BELIEF)]
        first = int(error.ticks[0])
        is_counted = error.ticks >= self.after * trace.tick_rate
        if not is_counted.any():
            last = trace.seconds(int(error.ticks[-1]))
            because = f"the last belief is from t = {last:.2f} s, but the evaluation begins at {self.after:.2f} s"
            return [undecided("localization_error", because)]
        error = error.select(is_counted)
        distances, angles = error.values.T
        findings = []
        if self.max is not None:
            largest = _judge_largest(trace, error, distances, "localization_error", self.max, "m")
            findings.append(self._if_first_belief_in_time(trace, first, largest))
        if self.rmse is not None:
            rmse = root_mean_square(distances, error_weights(trace, error))
            bound = at_most("localization_error rmse", rmse, self.rmse, "m", context="(not aligned)")
            findings.append(self._if_first_belief_in_time(trace, first, if_complete(trace, bound)))
        if self.final is not None:
            at = (trace, int(error.ticks[-1]))
            bound = at_most("localization_error final", float(distances[-1]), self.final, "m", at=at)
            findings.append(if_complete(trace, bound))
        if self.max_yaw is not None:
            largest = _judge_largest(trace, error, angles, "localization_error yaw", self.max_yaw, "rad")
            findings.append(self._if_first_belief_in_time(trace, first, largest))
        return findings

    def _if_first_belief_in_time(self, trace: Trace, first: int, finding: Finding) -> Finding:
        """Return the finding. If it passes, but the first belief (at tick `first`) is late, it becomes inconclusive.

        The first belief is late if it comes more than BELIEF_TIMEOUT_S after the evaluation has begun. The evaluation
        begins at `after`, or at the first true pose if this is later.
        """
        begin = max(self.after, trace.seconds(int(trace.truth.ticks[0])))
        if finding.status is not Status.PASS or first <= (begin + BELIEF_TIMEOUT_S) * trace.tick_rate:
            return finding
        known = f"the first belief is from t = {trace.seconds(first):.2f} s"
        because = f"{known}, but the evaluation begins at {begin:.2f} s"
        return undecided(finding.what, because, finding.limit)


def _judge_largest(trace: Trace, error: Samples, values: Array, what: str, limit: float, unit: str) -> Finding:
    """Return the finding for the largest of `values` (n,), which belong to the ticks of `error`."""
    k = int(np.argmax(values))
    return at_most(what, float(values[k]), limit, unit, at=(trace, int(error.ticks[k])))


class RelocalizedWithin(Spec, Criterion):
    """The robot relocalized in time.

    A robot is lost if its belief (the estimated pose) is not within the tolerances of the true pose, or if it has had
    no belief by the end of `time`.

    What is measured: the time from each start of `after`, or from the start of the run, until the belief of a lost
        robot is within the tolerances again and stays there for `hold`.
    When it fails: the time is longer than `time`.
    Why this: after a wrong initial pose or a kidnapping, the robot must correct its belief. A belief that is near the
        true pose only for an instant does not count as corrected.
    Source: the kidnapped robot problem, Thrun, Burgard, Fox: Probabilistic Robotics, chapters 7 and 8.

    Inconclusive if the robot was never lost within `time`, or if the run ended too early for a decision.

    Example: `relocalized_within: {time: 20 s, after: kidnapped, tolerance: 0.3 m}`
    """

    time: PositiveDuration
    """Maximum time in seconds."""
    after: DisturbanceName | None = None
    """Name of the event or fault that makes the robot lost; default: measure from the start of the run."""
    tolerance: PositiveLength = 0.25
    """Maximum position error."""
    yaw_tolerance: PositiveAngle = 0.25
    """Maximum heading error."""
    hold: PositiveDuration = 1.0
    """Time for which the belief must stay within the tolerances."""

    @property
    def evidence(self) -> frozenset[Evidence]:
        """Evidence in the log that the criterion needs."""
        disturbances = {Evidence.DISTURBANCES} if self.after is not None else set()
        return POSITION_EVIDENCE | {Evidence.BELIEF, *disturbances}

    def judge(self, trace: Trace, case: Case) -> list[Finding]:
        """Return one finding for each start of `after`, or one for the start of the run."""
        error = pose_error(trace)
        if not len(error):
            return [undecided("relocalized_within", NO_BELIEF)]
        active_spans = [Span(0, trace.end, False)] if self.after is None else spans(trace, self.after)
        if not active_spans:
            because, detail = never_started(trace, str(self.after))
            return [undecided("relocalized_within", because, self._limit_text, detail)]
        return [self._judge_start(trace, span.start, error) for span in active_spans]

    @property
    def _limit_text(self) -> str:
        return f"≤ {self.time:.2f} s {self._context_text}"

    @property
    def _context_text(self) -> str:
        return f"after {self.after}" if self.after is not None else "after the start"

    def _judge_start(self, trace: Trace, start: int, error: Samples) -> Finding:
        """Return the finding for the time from the tick `start` to the relocalization."""
        is_later = error.ticks >= start
        ticks, errors = error.ticks[is_later], error.values[is_later]
        is_localized = (errors[:, 0] <= self.tolerance) & (errors[:, 1] <= self.yaw_tolerance)
        limit = start + self.time * trace.tick_rate
        if error.ticks[0] <= limit and is_localized[ticks <= limit].all():
            return undecided("relocalized_within", f"the robot was never lost {self._context_text}", self._limit_text)
        # Only samples after the loss count as relocalization.
        first_lost = int(np.argmin(is_localized))
        relocalized, lasted = first_sustained(
            ticks[first_lost:], is_localized[first_lost:], round(self.hold * trace.tick_rate), trace.end
        )
        tick = trace.end if relocalized is None else relocalized
        elapsed = trace.seconds(tick - start)
        if not lasted and elapsed <= self.time:
            end = f"the run ended at t = {trace.seconds(trace.end):.2f} s ({end_reason(trace)})"
            correct_s = trace.seconds(trace.end - tick)
            state = (
                "the robot was still lost"
                if relocalized is None
                else f"the belief had been correct for only {correct_s:.2f} s"
            )
            return undecided("relocalized_within", f"{end}, when {state}", self._limit_text)
        detail = [f"the position error was at most {errors[:, 0].max():.2f} m, and {errors[-1, 0]:.2f} m at the end"]
        if relocalized is None:
            detail.append("the robot never relocalized")
        return at_most(
            "relocalized_within", elapsed, self.time, "s", at=(trace, tick), context=self._context_text, detail=detail
        )


class LocalizationConsistency(Spec, Criterion):
    """The covariance of the estimated pose matched its error.

    What is measured: the normalized estimation error squared (NEES) e' P⁻¹ e, where e is the error of the estimated
        pose (x, y, yaw) and P is its covariance. The samples are `every` apart. Their average over the run is 3 if the
        covariance is correct.
    When it fails: the average is above its upper bound (the robot is overconfident), or a covariance is singular. With
        `both_sides`, it also fails if the average is below its lower bound. With a correct covariance, the average is
        within the bounds with the given `probability`.
    Why this: a filter that is wrong but has a small covariance does not recover.
    Source: Bar-Shalom, Li, Kirubarajan 2001, section 5.4; filterpy's stats.NEES.

    The bounds assume that the samples are independent. Therefore, `every` should be longer than an error typically
    lasts. For a strict test, compare many runs at the same simulated time, as `simscen bench nav` does.

    Example: `localization_consistency: {every: 5 s, after: 10 s}`
    """

    probability: Annotated[float, Field(ge=0.5, le=0.9999), Quantity("ratio")] = 0.95
    """Probability with which a belief with a correct covariance passes."""
    every: PositiveDuration = 5.0
    """Time between two samples."""
    after: Duration = 0.0
    """Simulated time at which the evaluation begins, for example after the particle filter has converged."""
    both_sides: bool = False
    """Also fail if the covariance is too large."""

    @property
    def horizon(self) -> float:
        """Simulated time in s before which the criterion cannot pass."""
        return self.after

    evidence: ClassVar[frozenset[Evidence]] = POSITION_EVIDENCE | {Evidence.BELIEF, Evidence.COVARIANCE}

    def judge(self, trace: Trace, case: Case) -> list[Finding]:
        """Return the finding for the upper bound of the average, and with `both_sides` also for the lower bound."""
        if not len(pose_error(trace)):
            return [undecided("localization_consistency", NO_BELIEF)]
        samples = self._nees_at_regular_times(trace)
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
            findings.append(at_least("localization_consistency lower bound", mean, low, "", context=context))
        return [if_complete(trace, finding) for finding in findings]

    def _bounds(self, count: int) -> tuple[float | None, float]:
        """Return the lower and the upper bound of the average of `count` samples.

        Without `both_sides`, the lower bound is None.
        """
        if self.both_sides:
            return nees_mean_bounds(count, DIMENSIONS, self.probability)
        return None, chi2_quantile(self.probability, DIMENSIONS * count) / count

    def _nees_at_regular_times(self, trace: Trace) -> Samples | None:
        """Return the NEES (n, 1) at regular times from the first belief after `after`; None without covariances.

        Each belief is used at most once.
        """
        all_samples = nees_samples(trace)
        if not len(all_samples):
            return None
        samples = all_samples.select(all_samples.ticks >= self.after * trace.tick_rate)
        if not len(samples):
            return samples
        times = np.arange(samples.ticks[0], samples.ticks[-1] + 1, self.every * trace.tick_rate).astype(np.int64)
        chosen = np.searchsorted(samples.ticks, times, side="right") - 1
        return samples.select(np.unique(chosen))
