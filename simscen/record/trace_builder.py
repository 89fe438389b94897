"""Builder of the Trace (signals and events) of a run, and the tables in which the signals are collected.

A TraceBuilder collects signals from moments (records of single ticks), and the log reader from messages. Both convert
the same quaternions to yaw with the same function, so that both traces are equal to the bit.
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

    `rows` are the bytes of all rows. `pack` converts the numbers of a row to bytes.
    """

    def __init__(self, width: int) -> None:
        self._width = width + 1
        self.pack = struct.Struct(f"{width + 1}d").pack
        self.rows = bytearray()

    def add(self, tick: int, *values: float) -> None:
        """Append a row."""
        self.rows += self.pack(tick, *values)

    def append(self, tick: int, values: Array) -> None:
        """Append a row with the `width` numbers of an array of any shape."""
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
        table = np.frombuffer(bytes(self.rows)).reshape(-1, self._width)
        return table[:, 0].astype(np.int64), table[:, 1:]


def exact_planar_poses(points: Array) -> Array:
    """Return poses (n, 7) of points (n, 3) x, y, yaw, equal to the poses of Pose3.planar to the last bit."""
    # The log contains the poses of Pose3.planar. The sine of numpy is slightly different.
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

    A pose has seven columns: x, y, z and a quaternion x, y, z, w.

    Attributes:
        truth: True pose, vx, vy, wz.
        clearance: Clearance in m.
        belief: Estimated pose, and its covariance xx, xy, xyaw, yy, yyaw, yawyaw.
        odometry: Pose.
        command: vx, vy, wz.
        objects: Poses of moving objects, by name.
        scans: Ticks at which the stack received a scan.
        plans: Tick and poses (n, 7) of each plan.
        events: Events in order.
    """

    def __init__(self) -> None:
        self.truth = SignalBuffer(10)
        self.clearance = SignalBuffer(1)
        self.belief = SignalBuffer(13)
        self.odometry = SignalBuffer(7)
        self.command = SignalBuffer(3)
        self.objects: dict[str, SignalBuffer] = {}
        self._joint: dict[tuple[str, ...], SignalBuffer] = {}
        self.scans: list[int] = []
        self.plans: list[tuple[int, Array]] = []
        self.events: list[Event] = []

    def object(self, name: str) -> SignalBuffer:
        """Return the buffer of a moving object, and create it if necessary."""
        buffer = self.objects.get(name)
        if buffer is None:
            buffer = self.objects[name] = SignalBuffer(7)
        return buffer

    def joint_objects(self, names: tuple[str, ...]) -> SignalBuffer:
        """Return the joint buffer of objects that move together. A row has the poses of all these objects."""
        buffer = self._joint.get(names)
        if buffer is None:
            buffer = self._joint[names] = SignalBuffer(7 * len(names))
        return buffer

    def split_joint_objects(self) -> None:
        """Move the poses from joint buffers to the buffers of single objects, sorted by tick."""
        for names, buffer in self._joint.items():
            ticks, poses = buffer.columns()
            for column, name in enumerate(names):
                self.object(name).extend(ticks, poses[:, 7 * column : 7 * column + 7])
        for name in {name: None for names in self._joint for name in names}:
            self.objects[name].sort()
        self._joint.clear()

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
            odometry=_poses(self.odometry),
            command=Samples(*self.command.columns()),
            scans=np.unique(np.array(self.scans, dtype=np.int64)),
            plans=tuple(Path(to_planar(poses), tick) for tick, poses in self.plans),
            events=tuple(self.events),
            objects={name: _poses(self.objects[name]) for name in sorted(self.objects)},
            end=end,
        )


def _poses(buffer: SignalBuffer) -> Samples:
    ticks, poses = buffer.columns()
    return Samples(ticks, to_planar(poses))


class TraceBuilder:
    """Builds the Trace of a robot from its moments. The Trace is equal to the Trace that `read_log` reads."""

    def __init__(self, clock: Clock, thinning: Thinning | None = None) -> None:
        """Start an empty trace. `thinning` selects the samples to keep. A RobotPublisher of the robot can share it."""
        self._clock = clock
        self._thinning = Thinning(clock.rate) if thinning is None else thinning
        self._rows = TraceRows()
        self._truth, self._odometry, self._belief = SignalBuffer(11), SignalBuffer(3), SignalBuffer(9)
        """Their columns are: pose, twist, and clearance; x, y, yaw; x, y, yaw, and covariance.

        Appending is faster than to the buffers of TraceRows. `finish` converts their rows to rows of TraceRows.
        """

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

    def _add_objects(self, tick: int, moved: Mapping[str, Pose3]) -> None:
        if type(moved) is PosesAtTick:
            self._rows.joint_objects(moved.predicted.names).append(tick, moved.table)
            return
        for name, pose in moved.items():
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
