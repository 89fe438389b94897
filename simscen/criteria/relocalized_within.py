"""`relocalized_within`: how soon a lost robot knows again where it is."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from simscen.core.records.evidence import POSITION, Evidence
from simscen.core.records.verdict import Finding
from simscen.criteria.base import Criterion
from simscen.criteria.findings import at_most, undecided
from simscen.criteria.timeline import Span, end_reason, never_started, spans
from simscen.criteria.trace_signals.ground_truth import first_sustained, pose_error
from simscen.spec.base import Spec
from simscen.spec.quantities import PositiveAngle, PositiveDuration, PositiveLength
from simscen.spec.references import HappeningName

if TYPE_CHECKING:
    from simscen.core.records.case import Case
    from simscen.core.records.trace import Samples, Trace


class RelocalizedWithin(Spec, Criterion):
    """The robot found itself again in time.

    What is measured: time from the start of `after` (or of the run) until the belief, once lost, is within the
        tolerances of the true pose again and stays there for `hold`; each time that it happens.
    When it fails: that took longer than `time`.
    Why this: a wrong start or a kidnapping must be mended while driving, not merely survived; and a belief that
        crosses the truth by chance has not found it.
    Source: the kidnapped robot problem, Thrun, Burgard, Fox: Probabilistic Robotics, chapters 7 and 8.

    Inconclusive when the robot was never lost, or when the run was over before the time was.

    Example: `relocalized_within: {time: 20 s, after: kidnapped, tolerance: 0.3 m}`
    """

    time: PositiveDuration
    """Seconds."""
    after: HappeningName | None = None
    """The event or fault that made it lose itself; default: the start of the run."""
    tolerance: PositiveLength = 0.25
    """How far the believed position may be off."""
    yaw_tolerance: PositiveAngle = 0.25
    """How far the believed heading may be off."""
    hold: PositiveDuration = 1.0
    """It must stay right so long to count."""

    @property
    def evidence(self) -> frozenset[Evidence]:
        """What a log must hold for it to be decided."""
        started = {Evidence.DISTURBANCES} if self.after is not None else set()
        return POSITION | {Evidence.BELIEF, *started}

    def judge(self, trace: Trace, case: Case) -> list[Finding]:
        """One finding each time it happened."""
        error = pose_error(trace)
        if not len(error):
            return [undecided("relocalized_within", "the robot never said where it believes to be")]
        happened = [Span(0, trace.end, False)] if self.after is None else spans(trace, self.after)
        if not happened:
            because, detail = never_started(trace, str(self.after))
            return [undecided("relocalized_within", because, self._limit, detail)]
        return [self._once(trace, span.start, error) for span in happened]

    @property
    def _limit(self) -> str:
        return f"≤ {self.time:.2f} s {self._context}"

    @property
    def _context(self) -> str:
        return f"after {self.after}" if self.after is not None else "after the start"

    def _once(self, trace: Trace, start: int, error: Samples) -> Finding:
        later = error.ticks >= start
        ticks, off = error.ticks[later], error.values[later]
        right = (off[:, 0] <= self.tolerance) & (off[:, 1] <= self.yaw_tolerance)
        if right[ticks <= start + self.time * trace.tick_rate].all():
            return undecided("relocalized_within", f"the robot was never lost {self._context}", self._limit)
        # What held before it lost itself is no finding again.
        lost = int(np.argmin(right))
        found, lasted = first_sustained(ticks[lost:], right[lost:], round(self.hold * trace.tick_rate), trace.end)
        tick = trace.end if found is None else found
        elapsed = trace.seconds(tick - start)
        if not lasted and elapsed <= self.time:
            state = "still lost" if found is None else f"right for only {trace.seconds(trace.end - tick):.2f} s"
            because = (
                f"the run was over at t = {trace.seconds(trace.end):.2f} s ({end_reason(trace)}), the belief {state}"
            )
            return undecided("relocalized_within", because, self._limit)
        detail = [f"its belief was off by {off[:, 0].max():.2f} m at worst and {off[-1, 0]:.2f} m at the end"]
        if found is None:
            detail.append("it never found itself again")
        return at_most(
            "relocalized_within", elapsed, self.time, "s", at=(trace, tick), context=self._context, detail=detail
        )
