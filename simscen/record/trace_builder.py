"""The samples of a run as they are collected, and the Trace they make.

The TraceBuilder fills rows from moments, the log reader from messages. Both hand in headings as the quaternions that
the log stores, and one function turns them into yaw: so the two traces are equal to the last bit.
"""

import math
import struct
from collections.abc import Mapping

import numpy as np

from simscen.core.clock import Clock
from simscen.core.geometry import Array, Pose3
from simscen.core.geometry.scripted_poses import PosesAtTick
from simscen.core.messages.navigation import Path
from simscen.core.messages.sensor_data import Odometry, Scan
from simscen.core.records.events import Event
from simscen.core.records.trace import Moment, Samples, Ticks, Trace
from simscen.record.messages import event_text
from simscen.record.messages.encode_arrays import planar_poses
from simscen.record.trace_thinning import Thinning

_tick = struct.Struct("d").pack


class SignalBuffer:
    """A signal in the making: a tick and `width` numbers a row, which `pack` makes a part of `rows`.

    Ticks are exact in a double for a million years of simulated time.
    """

    def __init__(self, width: int) -> None:
        self._width = width + 1
        self.pack = struct.Struct(f"{width + 1}d").pack
        self.rows = bytearray()

    def add(self, tick: int, *values: float) -> None:
        """Append a row."""
        self.rows += self.pack(tick, *values)

    def append(self, tick: int, values: Array) -> None:
        """Append a row of as many numbers in whatever shape."""
        self.rows += _tick(tick)
        self.rows += values.tobytes()

    def extend(self, ticks: Ticks, values: Array) -> None:
        """Append rows: ticks (n,) and values (n, width)."""
        self.rows += np.column_stack((ticks, values)).tobytes()

    def sort(self) -> None:
        """Put rows in the order of their ticks."""
        ticks, values = self.columns()
        order = ticks.argsort(kind="stable")
        self.rows = bytearray()
        self.extend(ticks[order], values[order])

    def columns(self) -> tuple[Ticks, Array]:
        """Ticks (n,) and values (n, width)."""
        table = np.frombuffer(bytes(self.rows)).reshape(-1, self._width)
        return table[:, 0].astype(np.int64), table[:, 1:]


def yaw_from_quaternions(quaternions: Array) -> Array:
    """Rotations about z in [-π, π] of quaternions (n, 4) x, y, z, w."""
    x, y, z, w = quaternions.T.copy()
    angles: Array = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    return angles


def exact_planar_poses(points: Array) -> Array:
    """(n, 7) poses, as Pose3.planar makes them to the last bit, of points (n, 3) x, y, yaw."""
    poses = np.zeros((len(points), 7))
    poses[:, :2] = points[:, :2]
    halves = np.where(np.isfinite(points[:, 2]), points[:, 2] / 2, np.nan).tolist()
    poses[:, 5], poses[:, 6] = [math.sin(half) for half in halves], [math.cos(half) for half in halves]
    return poses


def to_planar(poses: Array) -> Array:
    """(n, 3) x, y, yaw of poses (n, 7): x, y, z and a quaternion."""
    return np.column_stack((poses[:, :2], yaw_from_quaternions(poses[:, 3:7])))


class TraceRows:
    """All signals of a run in the making. A pose is x, y, z and a quaternion x, y, z, w.

    truth: pose, vx, vy, wz · clearance: meters · belief: pose, xx, xy, xyaw, yy, yyaw, yawyaw · odometry: pose ·
    command: vx, vy, wz · objects: pose · plans: (tick made, poses (n, 7)).
    """

    def __init__(self) -> None:
        self.truth = SignalBuffer(10)
        self.clearance = SignalBuffer(1)
        self.belief = SignalBuffer(13)
        self.odometry = SignalBuffer(7)
        self.command = SignalBuffer(3)
        self.objects: dict[str, SignalBuffer] = {}
        self._together: dict[tuple[str, ...], SignalBuffer] = {}
        self.scans: list[int] = []
        self.plans: list[tuple[int, Array]] = []
        self.events: list[Event] = []

    def object(self, name: str) -> SignalBuffer:
        """The rows of a moving thing."""
        known = self.objects.get(name)
        if known is None:
            known = self.objects[name] = SignalBuffer(7)
        return known

    def together(self, names: tuple[str, ...]) -> SignalBuffer:
        """The rows of things at ticks at which all of them have moved, one pose beside the other; until `part`."""
        known = self._together.get(names)
        if known is None:
            known = self._together[names] = SignalBuffer(7 * len(names))
        return known

    def part(self) -> None:
        """Give each thing its own rows, in the order of their ticks."""
        for names, series in self._together.items():
            ticks, poses = series.columns()
            for column, name in enumerate(names):
                self.object(name).extend(ticks, poses[:, 7 * column : 7 * column + 7])
        for name in {name: None for names in self._together for name in names}:
            self.objects[name].sort()
        self._together.clear()

    def trace(self, tick_rate: int, end: int) -> Trace:
        """What happened until `end`."""
        truth_ticks, truth = self.truth.columns()
        belief_ticks, belief = self.belief.columns()
        return Trace(
            tick_rate=tick_rate,
            truth=Samples(truth_ticks, to_planar(truth)),
            velocity=Samples(truth_ticks, truth[:, 7:]),
            clearance=Samples(*self.clearance.columns()),
            belief=Samples(belief_ticks, np.column_stack((to_planar(belief), belief[:, 7:]))),
            odometry=_poses(self.odometry),
            command=Samples(*self.command.columns()),
            scans=np.unique(np.array(self.scans, dtype=np.int64)),
            plans=tuple(Path(to_planar(poses), tick) for tick, poses in self.plans),
            events=tuple(self.events),
            objects={name: _poses(self.objects[name]) for name in sorted(self.objects)},
            end=end,
        )


def _poses(series: SignalBuffer) -> Samples:
    ticks, poses = series.columns()
    return Samples(ticks, to_planar(poses))


class TraceBuilder:
    """Eats moments in the order of their ticks; `finish` gives the Trace.

    It is the very Trace that `replay.read_log` gives for a log recorded from the same moments: headings take the way
    over the log's quaternions, which costs them at most a last bit.
    """

    def __init__(self, clock: Clock, thinning: Thinning | None = None) -> None:
        """`thinning` is that of a log which is told of each moment next, so that what is kept is worked out once."""
        self._clock = clock
        self._thinning = Thinning(clock.rate) if thinning is None else thinning
        self._rows = TraceRows()
        self._truth, self._odometry, self._belief = SignalBuffer(11), SignalBuffer(3), SignalBuffer(9)
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
            rows.plans.append((decision.plan.tick, planar_poses(decision.plan.points)))
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
        rows.odometry.extend(ticks, exact_planar_poses(odometry))
        ticks, belief = self._belief.columns()
        rows.belief.extend(ticks, np.column_stack((exact_planar_poses(belief), belief[:, 3:])))
        rows.part()
        return rows.trace(self._clock.rate, end_tick)
