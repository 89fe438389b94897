"""Collects the moments of a run into its Trace."""

from simscen.core.belief import Belief
from simscen.core.geometry import Pose3
from simscen.core.sensing import Odometry, Scan
from simscen.core.time import Clock
from simscen.core.trace import Moment, Trace
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
        tick, truth, decision, rows = moment.tick, moment.truth, moment.decision, self._rows
        if truth is not None:
            rows.truth.add(tick, (*truth.pose, *truth.twist))
            rows.clearance.add(tick, (truth.clearance,))
            if truth.objects:
                for name, pose in self._thinning.moved(tick, truth).items():
                    rows.object(name).add(tick, pose)
        for reading in moment.readings:
            if isinstance(reading, Odometry):
                if self._thinning.keeps_odometry(reading):
                    rows.odometry.add(tick, Pose3.planar(reading.pose))
            elif isinstance(reading, Scan):
                rows.scans.append(tick)
        if self._thinning.keeps_command(tick, decision.command):
            rows.command.add(tick, decision.command)
        if decision.belief is not None:
            self._belief(tick, decision.belief)
        if decision.plan is not None:
            rows.plans.append((decision.plan.tick, ground_poses(decision.plan.points)))
        if moment.events or decision.events:
            for event in (*moment.events, *decision.events):
                rows.events.append(event_text.from_json(event_text.to_json(event)))

    def finish(self, end_tick: int) -> Trace:
        """The run until `end_tick`."""
        return self._rows.trace(self._clock.rate, end_tick)

    def _belief(self, tick: int, belief: Belief) -> None:
        xx, xy, xa, _, yy, ya, _, _, aa = belief.covariance.ravel().tolist()
        self._rows.belief.add(tick, (*Pose3.planar(belief.pose), xx, xy, xa, yy, ya, aa))
