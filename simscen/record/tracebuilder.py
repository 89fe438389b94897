"""Collects the moments of a run into its Trace."""

from simscen.core.belief import Belief
from simscen.core.geometry import Pose3
from simscen.core.sensing import Odometry, Readings, Scan
from simscen.core.time import Clock
from simscen.core.trace import Moment, Trace, Truth
from simscen.record import event_text
from simscen.record.pack_many import ground_poses
from simscen.record.rows import Rows
from simscen.record.thinning import Thinning


class TraceBuilder:
    """Eats moments in the order of their ticks; `finish` gives the Trace.

    It is the very Trace that `replay.read_log` gives for a log recorded from the same moments: headings take the way
    over the log's quaternions, which costs them at most a last bit.
    """

    def __init__(self, clock: Clock) -> None:
        self._clock = clock
        self._thinning = Thinning(clock.rate)
        self._rows = Rows()

    def append(self, moment: Moment) -> None:
        """Take in one beat: appends a few numbers, computes nothing."""
        tick, decision, rows = moment.tick, moment.decision, self._rows
        if moment.truth is not None:
            self._truth(tick, moment.truth)
        self._readings(tick, moment.readings)
        if self._thinning.keeps_command(tick, decision.command):
            rows.command.add(tick, decision.command)
        if decision.belief is not None:
            self._belief(tick, decision.belief)
        if decision.plan is not None:
            rows.plans.append((decision.plan.tick, ground_poses(decision.plan.points)))
        for event in (*moment.events, *decision.events):
            rows.events.append(event_text.from_json(event_text.to_json(event)))

    def finish(self, end_tick: int) -> Trace:
        """The run until `end_tick`."""
        return self._rows.trace(self._clock.rate, end_tick)

    def _truth(self, tick: int, truth: Truth) -> None:
        self._rows.truth.add(tick, (*truth.pose, *truth.twist))
        self._rows.clearance.add(tick, (truth.clearance,))
        for name, pose in self._thinning.moved(tick, truth):
            self._rows.object(name).add(tick, pose)

    def _readings(self, tick: int, readings: Readings) -> None:
        for reading in readings:
            if isinstance(reading, Odometry):
                if self._thinning.keeps_odometry(reading):
                    self._rows.odometry.add(tick, Pose3.planar(reading.pose))
            elif isinstance(reading, Scan):
                self._rows.scans.append(tick)

    def _belief(self, tick: int, belief: Belief) -> None:
        xx, xy, xa, _, yy, ya, _, _, aa = belief.covariance.ravel().tolist()
        self._rows.belief.add(tick, (*Pose3.planar(belief.pose), xx, xy, xa, yy, ya, aa))
