"""Collects the moments of a run into its Trace."""

from collections.abc import Mapping

import numpy as np

from simscen.core.clock import Clock
from simscen.core.geometry import Pose3
from simscen.core.geometry.scripted_poses import PosesAtTick
from simscen.core.messages.sensor_data import Odometry, Scan
from simscen.core.records.trace import Moment, Trace
from simscen.record import event_text
from simscen.record.pack_many import ground_poses
from simscen.record.rows import Rows, Series, lifted
from simscen.record.thinning import Thinning


class TraceBuilder:
    """Eats moments in the order of their ticks; `finish` gives the Trace.

    It is the very Trace that `replay.read_log` gives for a log recorded from the same moments: headings take the way
    over the log's quaternions, which costs them at most a last bit.
    """

    def __init__(self, clock: Clock, thinning: Thinning | None = None) -> None:
        """`thinning` is that of a log which is told of each moment next, so that what is kept is worked out once."""
        self._clock = clock
        self._thinning = Thinning(clock.rate) if thinning is None else thinning
        self._rows = Rows()
        self._truth, self._odometry, self._belief = Series(11), Series(3), Series(9)
        """Pose, twist and clearance; x, y, yaw; the same with a covariance: they become rows at the end."""

    def append(self, moment: Moment) -> None:
        """Take in one beat: appends a few numbers, computes nothing."""
        tick, truth, decision = moment.tick, moment.truth, moment.decision
        rows, thinning = self._rows, self._thinning
        if truth is not None:
            pose, twist, clearance, objects = truth
            series = self._truth
            series.rows += series.pack(tick, *pose, *twist, clearance)
            if objects:
                self._add_objects(tick, thinning.moved(tick, truth))
        for reading in moment.readings:
            if type(reading) is Odometry:
                if thinning.keeps_odometry(reading):
                    series = self._odometry
                    series.rows += series.pack(tick, *reading.pose)
            elif type(reading) is Scan:
                rows.scans.append(tick)
        if thinning.keeps_command(tick, decision.command):
            rows.command.add(tick, *decision.command)
        if decision.belief is not None:
            xx, xy, xa, _, yy, ya, _, _, aa = decision.belief.covariance.ravel().tolist()
            self._belief.add(tick, *decision.belief.pose, xx, xy, xa, yy, ya, aa)
        if decision.plan is not None:
            rows.plans.append((decision.plan.tick, ground_poses(decision.plan.points)))
        if moment.events or decision.events:
            for event in (*moment.events, *decision.events):
                rows.events.append(event_text.from_json(event_text.to_json(event)))

    def _add_objects(self, tick: int, moved: Mapping[str, Pose3]) -> None:
        if type(moved) is PosesAtTick:
            self._rows.together(moved.predicted.names).append(tick, moved.table)
            return
        for name, pose in moved.items():
            series = self._rows.object(name)
            series.rows += series.pack(tick, *pose)

    def finish(self, end_tick: int) -> Trace:
        """The run until `end_tick`; nothing may be appended to it from then on."""
        rows, (ticks, truth) = self._rows, self._truth.columns()
        rows.truth.extend(ticks, truth[:, :10])
        rows.clearance.extend(ticks, truth[:, 10:])
        ticks, odometry = self._odometry.columns()
        rows.odometry.extend(ticks, lifted(odometry))
        ticks, belief = self._belief.columns()
        rows.belief.extend(ticks, np.column_stack((lifted(belief), belief[:, 3:])))
        rows.part()
        return rows.trace(self._clock.rate, end_tick)
