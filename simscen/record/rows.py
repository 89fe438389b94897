"""The samples of a run as they are collected, and the Trace they make.

The TraceBuilder fills rows from moments, the log reader from messages. Both hand in headings as the quaternions that
the log stores, and one function turns them into yaw: so the two traces are equal to the last bit.
"""

import math
import struct

import numpy as np

from simscen.core.geometry import Array
from simscen.core.messages.navigation import Path
from simscen.core.records.events import Event
from simscen.core.records.trace import Samples, Ticks, Trace

_tick = struct.Struct("d").pack


class Series:
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


def yaw(quaternions: Array) -> Array:
    """Rotations about z in [-π, π] of quaternions (n, 4) x, y, z, w."""
    x, y, z, w = quaternions.T.copy()
    angles: Array = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    return angles


def lifted(points: Array) -> Array:
    """(n, 7) poses, as Pose3.planar makes them to the last bit, of points (n, 3) x, y, yaw."""
    poses = np.zeros((len(points), 7))
    poses[:, :2] = points[:, :2]
    halves = np.where(np.isfinite(points[:, 2]), points[:, 2] / 2, np.nan).tolist()
    poses[:, 5], poses[:, 6] = [math.sin(half) for half in halves], [math.cos(half) for half in halves]
    return poses


def on_the_ground(poses: Array) -> Array:
    """(n, 3) x, y, yaw of poses (n, 7): x, y, z and a quaternion."""
    return np.column_stack((poses[:, :2], yaw(poses[:, 3:7])))


class Rows:
    """All signals of a run in the making. A pose is x, y, z and a quaternion x, y, z, w.

    truth: pose, vx, vy, wz · clearance: meters · belief: pose, xx, xy, xyaw, yy, yyaw, yawyaw · odometry: pose ·
    command: vx, vy, wz · objects: pose · plans: (tick made, poses (n, 7)).
    """

    def __init__(self) -> None:
        self.truth = Series(10)
        self.clearance = Series(1)
        self.belief = Series(13)
        self.odometry = Series(7)
        self.command = Series(3)
        self.objects: dict[str, Series] = {}
        self._together: dict[tuple[str, ...], Series] = {}
        self.scans: list[int] = []
        self.plans: list[tuple[int, Array]] = []
        self.events: list[Event] = []

    def object(self, name: str) -> Series:
        """The rows of a moving thing."""
        known = self.objects.get(name)
        if known is None:
            known = self.objects[name] = Series(7)
        return known

    def together(self, names: tuple[str, ...]) -> Series:
        """The rows of things at ticks at which all of them have moved, one pose beside the other; until `part`."""
        known = self._together.get(names)
        if known is None:
            known = self._together[names] = Series(7 * len(names))
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
            truth=Samples(truth_ticks, on_the_ground(truth)),
            velocity=Samples(truth_ticks, truth[:, 7:]),
            clearance=Samples(*self.clearance.columns()),
            belief=Samples(belief_ticks, np.column_stack((on_the_ground(belief), belief[:, 7:]))),
            odometry=_poses(self.odometry),
            command=Samples(*self.command.columns()),
            scans=np.unique(np.array(self.scans, dtype=np.int64)),
            plans=tuple(Path(on_the_ground(poses), tick) for tick, poses in self.plans),
            events=tuple(self.events),
            objects={name: _poses(self.objects[name]) for name in sorted(self.objects)},
            end=end,
        )


def _poses(series: Series) -> Samples:
    ticks, poses = series.columns()
    return Samples(ticks, on_the_ground(poses))
