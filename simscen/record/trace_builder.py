"""Builder of the Trace (signals and events) of a run, and the tables in which the signals are collected.

A TraceBuilder collects signals from moments (records of single ticks). The log reader collects signals from messages.
Both convert the same quaternions to yaw with `to_planar`, so that their traces are equal to the bit.
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
from simscen.record.messages.encode import planar_poses
from simscen.record.trace_thinning import Thinning

_pack_tick = struct.Struct("d").pack


class SignalBuffer:
    """Growing table of a signal. Each row has a tick and `width` numbers.

    Attributes:
        rows: Bytes of all rows.
        pack: Function that converts the tick and the numbers of a row to bytes.
    """

    def __init__(self, width: int) -> None:
        self._row_length = width + 1
        self.pack = struct.Struct(f"{width + 1}d").pack
        self.rows = bytearray()

    def add(self, tick: int, *values: float) -> None:
        """Append a row with `width` values."""
        self.rows += self.pack(tick, *values)

    def append(self, tick: int, values: Array) -> None:
        """Append a row with the `width` numbers of an array. The array may have any shape."""
        self.rows += _pack_tick(tick)
        self.rows += values.tobytes()

    def extend(self, ticks: Ticks, values: Array) -> None:
        """Append n rows with ticks (n,) and values (n, width)."""
        self.rows += np.column_stack((ticks, values)).tobytes()

    def sort(self) -> None:
        """Sort the rows by tick."""
        ticks, values = self.columns()
        order = ticks.argsort(kind="stable")
        self.rows = bytearray()
        self.extend(ticks[order], values[order])

    def columns(self) -> tuple[Ticks, Array]:
        """Return ticks (n,) and values (n, width)."""
        table = np.frombuffer(bytes(self.rows)).reshape(-1, self._row_length)
        return table[:, 0].astype(np.int64), table[:, 1:]


def exact_planar_poses(points: Array) -> Array:
    """Return the poses (n, 7) of points (n, 3) x, y, yaw. They are equal to the poses of Pose3.planar to the last bit.

    A pose is x, y, z and a quaternion x, y, z, w.
    """
    # The log contains the poses of Pose3.planar. Sines of numpy can differ from sines of math in the last bit.
    poses = np.zeros((len(points), 7))
    poses[:, :2] = points[:, :2]
    halves = np.where(np.isfinite(points[:, 2]), points[:, 2] / 2, np.nan).tolist()
    poses[:, 5], poses[:, 6] = [math.sin(half) for half in halves], [math.cos(half) for half in halves]
    return poses


def to_planar(poses: Array) -> Array:
    """Return x, y, yaw (n, 3) of poses (n, 7 or more): x, y, z, and a quaternion x, y, z, w."""
    x, y, z, w = poses[:, 3:7].T.copy()
    return np.column_stack((poses[:, :2], np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))))


class TraceRows:
    """Collected signals and events of a run.

    A pose has seven columns: x, y, z in m and a quaternion x, y, z, w. A twist has three columns in the base frame:
    vx and vy in m/s, wz in rad/s.

    Attributes:
        truth: True pose in the world frame, and true twist.
        clearance: Clearance in m.
        belief: Estimated pose in the map frame, and its covariance xx, xy, xyaw, yy, yyaw, yawyaw.
        odometry: Pose in the odom frame.
        command: Commanded twist.
        objects: Poses of moving objects in the world frame, by name.
        scans: Ticks at which the stack received a scan.
        plans: Tick and poses (n, 7) in the map frame of each plan.
        events: Events in order.
    """

    def __init__(self) -> None:
        self.truth = SignalBuffer(10)
        self.clearance = SignalBuffer(1)
        self.belief = SignalBuffer(13)
        self.odometry = SignalBuffer(7)
        self.command = SignalBuffer(3)
        self.objects: dict[str, SignalBuffer] = {}
        self._joint_objects: dict[tuple[str, ...], SignalBuffer] = {}
        self.scans: list[int] = []
        self.plans: list[tuple[int, Array]] = []
        self.events: list[Event] = []

    def object(self, name: str) -> SignalBuffer:
        """Return the buffer of a moving object. Create the buffer if the object is new."""
        buffer = self.objects.get(name)
        if buffer is None:
            buffer = self.objects[name] = SignalBuffer(7)
        return buffer

    def joint_objects(self, names: tuple[str, ...]) -> SignalBuffer:
        """Return the joint buffer of several objects. A row has the poses of all these objects at one tick."""
        buffer = self._joint_objects.get(names)
        if buffer is None:
            buffer = self._joint_objects[names] = SignalBuffer(7 * len(names))
        return buffer

    def split_joint_objects(self) -> None:
        """Move the poses from joint buffers to the buffers of single objects, sorted by tick."""
        for names, buffer in self._joint_objects.items():
            ticks, poses = buffer.columns()
            for column, name in enumerate(names):
                self.object(name).extend(ticks, poses[:, 7 * column : 7 * column + 7])
        for name in {name: None for names in self._joint_objects for name in names}:
            self.objects[name].sort()
        self._joint_objects.clear()

    def trace(self, tick_rate: int, end: int) -> Trace:
        """Return the Trace until the tick `end`."""
        truth_ticks, truth = self.truth.columns()
        belief_ticks, belief = self.belief.columns()
        return Trace(
            tick_rate=tick_rate,
            truth=Samples(truth_ticks, to_planar(truth)),
            velocity=Samples(truth_ticks, truth[:, 7:]),
            clearance=Samples(*self.clearance.columns()),
            belief=Samples(belief_ticks, np.column_stack((to_planar(belief), belief[:, 7:]))),
            odometry=_planar_samples(self.odometry),
            command=Samples(*self.command.columns()),
            scans=np.unique(np.array(self.scans, dtype=np.int64)),
            plans=tuple(Path(to_planar(poses), tick) for tick, poses in self.plans),
            events=tuple(self.events),
            objects={name: _planar_samples(self.objects[name]) for name in sorted(self.objects)},
            end=end,
        )


def _planar_samples(buffer: SignalBuffer) -> Samples:
    """Return the samples x, y, yaw of a buffer of poses."""
    ticks, poses = buffer.columns()
    return Samples(ticks, to_planar(poses))


class TraceBuilder:
    """Builds the Trace of a robot from its moments. The Trace is equal to the Trace that `read_log` reads."""

    def __init__(self, clock: Clock, thinning: Thinning | None = None) -> None:
        """Start an empty trace. `thinning` selects the samples to keep, and may be the Thinning of a RobotPublisher."""
        self._clock = clock
        self._thinning = Thinning(clock.rate) if thinning is None else thinning
        self._rows = TraceRows()
        # These buffers need no quaternions and are therefore faster than the buffers of TraceRows. `finish` converts
        # the rows to rows of TraceRows.
        self._truth = SignalBuffer(11)
        """Pose, twist, and clearance."""
        self._odometry = SignalBuffer(3)
        """x, y, yaw."""
        self._belief = SignalBuffer(9)
        """x, y, yaw, and covariance."""

    def append(self, moment: Moment) -> None:
        """Add one moment. Moments must be added in the order of their ticks."""
        tick, truth, decision = moment.tick, moment.truth, moment.decision
        rows, thinning = self._rows, self._thinning
        if truth is not None:
            pose, twist, clearance, objects = truth
            buffer = self._truth
            buffer.rows += buffer.pack(tick, *pose, *twist, clearance)
            if objects:
                self._add_objects(tick, thinning.objects_to_keep(tick, truth))
        for reading in moment.readings:
            if type(reading) is Odometry:
                if thinning.keeps_odometry(reading):
                    buffer = self._odometry
                    buffer.rows += buffer.pack(tick, *reading.pose)
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

    def _add_objects(self, tick: int, poses: Mapping[str, Pose3]) -> None:
        """Add the poses of objects by name."""
        if type(poses) is PosesAtTick:
            self._rows.joint_objects(poses.predicted.names).append(tick, poses.table)
            return
        for name, pose in poses.items():
            buffer = self._rows.object(name)
            buffer.rows += buffer.pack(tick, *pose)

    def finish(self, end_tick: int) -> Trace:
        """Return the Trace until `end_tick`. No moment may be added afterwards."""
        rows, (ticks, truth) = self._rows, self._truth.columns()
        rows.truth.extend(ticks, truth[:, :10])
        rows.clearance.extend(ticks, truth[:, 10:])
        ticks, odometry = self._odometry.columns()
        rows.odometry.extend(ticks, exact_planar_poses(odometry))
        ticks, belief = self._belief.columns()
        rows.belief.extend(ticks, np.column_stack((exact_planar_poses(belief), belief[:, 3:])))
        rows.split_joint_objects()
        return rows.trace(self._clock.rate, end_tick)
