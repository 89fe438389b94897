"""The criteria `stopped_within` (the robot stopped in time) and `stuck` (the robot was never stuck)."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from simscen.core.records.verdict import Evidence, Finding
from simscen.criteria.base import Criterion
from simscen.criteria.findings import MissingEvidence, at_most, held, missed, undecided
from simscen.criteria.goal_outcomes import goal_outcomes
from simscen.criteria.timeline import Span, end_reason, first_sustained, never_started, spans
from simscen.criteria.trace_signals.ground_truth import Flags, drive, speed, truth, turn_rate
from simscen.spec.base import Spec
from simscen.spec.places import DisturbanceName
from simscen.spec.quantities import PositiveAngularSpeed, PositiveDuration, PositiveLength, PositiveSpeed

if TYPE_CHECKING:
    from simscen.core.records.case import Case
    from simscen.core.records.trace import Samples, Trace


STALE_SCAN_S = 0.2
"""Age of the newest scan above which the text of a finding calls the robot blind: two periods of a 10 Hz lidar."""


class StoppedWithin(Spec, Criterion):
    """The robot stopped in time after a fault or an event.

    What is measured: the time from each start of `after` until the robot stands. The robot stands if its true speed is
        at most `speed` and its true turn rate at most `turn_rate` for the duration `hold`. The time ends when this
        duration begins.
    When it fails: the time is longer than `time`. With `stay`, it also fails if the robot moves again before the fault
        or event ends.
    Why this: a robot without sensor data must not drive. The true speed counts, because a robot can roll on after a
        command of zero.
    Source: Nav2's collision monitor, whose source_timeout stops a robot without sensor data.

    Inconclusive if `after` never started, if the robot was already standing at each start of `after`, or if the fault,
    event, or run ended before `time` and before the robot had stopped.

    Example: `stopped_within: {time: 0.5 s, after: lidar.off}`
    """

    time: PositiveDuration
    """Maximum time in s from the start of `after` until the robot stands."""
    after: DisturbanceName
    """Name of the fault, e.g. `lidar.off`, or of the event."""
    speed: PositiveSpeed = 0.02
    """Maximum speed over ground of a standing robot in m/s."""
    turn_rate: PositiveAngularSpeed = 0.05
    """Maximum turn rate of a standing robot in rad/s."""
    hold: PositiveDuration = 0.2
    """Minimum duration of standing, because a change of direction is not a stop."""
    stay: bool = False
    """Require that the robot stands until the fault or event ends."""

    evidence: ClassVar[frozenset[Evidence]] = frozenset({Evidence.TRUTH, Evidence.VELOCITY, Evidence.DISTURBANCES})

    def judge(self, trace: Trace, case: Case) -> list[Finding]:
        """Return one finding for each start of `after`. With `stay`, add a second finding if the robot stopped.

        Raises MissingEvidence if the trace has no velocity.
        """
        if not len(trace.velocity):
            raise MissingEvidence("the robot's true velocity was not recorded")
        active_spans = spans(trace, self.after)
        if not active_spans:
            because, detail = never_started(trace, self.after)
            return [undecided("stopped_within", because, self._limit_text, detail)]
        is_slow = speed(trace).values[:, 0] <= self.speed
        is_standing = is_slow & (turn_rate(trace).values[:, 0] <= self.turn_rate)
        if all(_stood_before(trace, is_standing, span.start) for span in active_spans):
            because = f"the robot was not moving when `{self.after}` started, so nothing had to stop"
            return [undecided("stopped_within", because, self._limit_text)]
        return [finding for span in active_spans for finding in self._judge_span(trace, span, is_standing)]

    @property
    def _limit_text(self) -> str:
        return f"≤ {self.time:.2f} s after {self.after}"

    def _judge_span(self, trace: Trace, span: Span, is_standing: Flags) -> list[Finding]:
        """Return the findings for one interval in which the fault or event was active."""
        first = max(int(np.searchsorted(trace.velocity.ticks, span.start, side="right")) - 1, 0)
        hold = round(self.hold * trace.tick_rate)
        stop, lasted = first_sustained(trace.velocity.ticks[first:], is_standing[first:], hold, trace.end)
        stop = None if stop is None or stop > span.end else max(stop, span.start)
        end = span.end if stop is None else stop
        elapsed = trace.seconds(end - span.start)
        if elapsed <= self.time and not (stop is not None and lasted):
            ended = f"`{self.after}`" if span.has_end_event and stop is None else f"the run ({end_reason(trace)})"
            if stop is None:
                because = f"{ended} ended {elapsed:.2f} s after the start of `{self.after}`, while the robot moved"
            else:
                because = f"{ended} ended before the robot had stood for {self.hold:.2f} s"
            return [undecided("stopped_within", because, self._limit_text)]
        detail = _describe_motion(trace, span.start, end) + ([] if stop is not None else ["it never came to rest"])
        context = f"after {self.after}"
        finding = at_most("stopped_within", elapsed, self.time, "s", at=(trace, end), context=context, detail=detail)
        stay = [self._judge_stay(trace, span, end, is_standing)] if self.stay and stop is not None else []
        return [finding, *stay]

    def _judge_stay(self, trace: Trace, span: Span, stop: int, is_standing: Flags) -> Finding:
        """Return the finding that the robot stood from the tick `stop` to the end of the interval."""
        ticks = trace.velocity.ticks
        moving_ticks = ticks[~is_standing & (ticks > stop) & (ticks < span.end)]
        expected = f"standing until {self.after} ends"
        if not len(moving_ticks):
            return held("stayed", "stood still", expected)
        first = int(moving_ticks[0])
        elapsed = trace.seconds(first - span.start)
        return missed("stayed", f"moved again {elapsed:.2f} s after {self.after} started", expected, (trace, first))


def _stood_before(trace: Trace, is_standing: Flags, tick: int) -> bool:
    """Return whether the robot stood at the last sample before `tick`, or else at the first sample."""
    return bool(is_standing[max(int(np.searchsorted(trace.velocity.ticks, tick, side="left")) - 1, 0)])


def _describe_motion(trace: Trace, start: int, end: int) -> list[str]:
    """Return lines that describe the motion of the robot between two ticks."""
    path, speeds = drive(trace), speed(trace)
    length, seconds = path.until(end) - path.until(start), trace.seconds(end - start)
    received = trace.scans[trace.scans <= end]
    age = trace.seconds(end - int(received[-1])) if len(received) else math.inf
    line = f"drove {length:.2f} m{' blind' if age > STALE_SCAN_S else ''} at {length / max(seconds, 1e-9):.2f} m/s"
    if STALE_SCAN_S < age < math.inf:
        line += f"; the newest scan was {age:.1f} s old"
    top = float(speeds.values[(speeds.ticks >= start) & (speeds.ticks <= end), 0].max(initial=0.0))
    return [line, f"its top speed in that time was {top:.2f} m/s"]


class Stuck(Spec, Criterion):
    """The robot was never stuck: it made progress while it had a goal.

    What is measured: the longest time for which the robot stayed within `radius` of one position while it had a goal.
    When it fails: the time is longer than `max`.
    Why this: a robot that spins and backs up for a minute before it arrives passes all other criteria.
    Source: Nav2's SimpleProgressChecker, including its defaults; ScenarioRunner's ActorBlockedTest.

    Example: `stuck: {max: 10 s}`
    """

    max: PositiveDuration = 10.0
    """Maximum time in seconds."""
    radius: PositiveLength = 0.5
    """Distance in meters that the robot must move away from a position to make progress."""

    evidence: ClassVar[frozenset[Evidence]] = frozenset({Evidence.TRUTH, Evidence.NAVIGATION})

    def judge(self, trace: Trace, case: Case) -> list[Finding]:
        """Return the finding for the longest standstill over all goals."""
        poses = truth(trace)
        drives = [
            (outcome.accepted_tick, trace.end if outcome.end is None else outcome.end.tick)
            for outcome in goal_outcomes(trace, case)
            if outcome.accepted_tick is not None
        ]
        standstills = [
            standstill for start, end in drives for standstill in _standstills(poses, start, end, self.radius)
        ]
        if not standstills:
            return [undecided("stuck", "no goal was ever under way", f"≤ {self.max:.2f} s")]
        longest, tick = max(standstills, key=lambda standstill: (standstill[0], -standstill[1]))
        detail = [f"from t = {trace.seconds(tick - longest):.2f} s on it stayed within {self.radius:.2f} m"]
        return [at_most("stuck", trace.seconds(longest), self.max, "s", at=(trace, tick), detail=detail)]


def _standstills(poses: Samples, start: int, end: int, radius: float) -> list[tuple[int, int]]:
    """Divide a drive from tick `start` to `end` into periods. Return (duration, end) of each period in ticks.

    As in Nav2's progress checker, a period ends when the robot is more than `radius` m away from its position at the
    start of the period. The list is empty if there is no sample between `start` and `end`.
    """
    first, last = np.searchsorted(poses.ticks, (start, end + 1), side="left").tolist()
    if first == last:
        return []
    xs, ys, ticks = poses.values[:, 0].tolist(), poses.values[:, 1].tolist(), poses.ticks.tolist()
    periods, first_of_period, period_start = [], first, start
    for k in range(first, last):
        if math.hypot(xs[k] - xs[first_of_period], ys[k] - ys[first_of_period]) > radius:
            periods.append((ticks[k] - period_start, ticks[k]))
            first_of_period, period_start = k, ticks[k]
    return [*periods, (end - period_start, end)]
