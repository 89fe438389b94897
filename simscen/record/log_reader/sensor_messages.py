"""What a log shows of a robot besides its trace: scans, particles, local plans and costmaps, for whoever looks."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.geometry import Array, Pose2, Pose3
from simscen.core.messages.sensor_data import Scan
from simscen.record import topics
from simscen.record.frame_names import RobotFrames
from simscen.record.messages.cdr import CdrReader
from simscen.record.simtime import NS_PER_SECOND, SimTime
from simscen.record.trace_builder import to_planar

LoggedMessages = list[tuple[int, bytes]]
"""Each with the tick at which it was written."""


@dataclass(eq=False)
class SensorMessages:
    """Messages as they are in the log: most of them are never looked at, and reading all would take long.

    `scans` are by topic; `mounts` are where lidars sit, by their frames. Unless `stamped`, the ticks of the log are not
    those of the messages' headers: a scan was measured when it was logged. `names` are the robot's frames.
    """

    time: SimTime = field(default_factory=lambda: SimTime(1))
    scans: dict[str, LoggedMessages] = field(default_factory=dict)
    particles: LoggedMessages = field(default_factory=list)
    local_plans: LoggedMessages = field(default_factory=list)
    costmaps: dict[str, LoggedMessages] = field(default_factory=dict)
    mounts: dict[str, Pose3] = field(default_factory=dict)
    stamped: bool = True
    names: RobotFrames = field(default_factory=RobotFrames)

    def taker(self, topic: str, kind: str) -> Callable[[int, bytes], None] | None:
        """What takes the messages of a topic; None for one that nobody looks at."""
        if kind == topics.SCAN_TYPE:
            return _append_to(self.scans.setdefault(topic, []))
        if (topic, kind) == topics.PARTICLES[:2]:
            return _append_to(self.particles)
        if (topic, kind) == topics.LOCAL_PLAN[:2]:
            return _append_to(self.local_plans)
        if kind == topics.MAP.type and topic.endswith("costmap/costmap"):
            return _append_to(self.costmaps.setdefault(topic, []))
        return None

    def scan(self, data: bytes) -> Scan:
        """A sensor_msgs/msg/LaserScan, with the tick at which it was measured."""
        cursor = CdrReader(data)
        tick, frame = self._header(cursor)
        low, _, step, _, _, nearest, furthest = cursor.take("7f")
        ranges = cursor.array("<f4", (cursor.count(),)).astype(np.float64)
        mount = self.mounts.get(frame, Pose3()).plane
        return Scan(frame, tick, ranges, low, step, nearest, furthest, mount)

    def cloud(self, data: bytes) -> Array:
        """(n, 3) x, y, yaw of a nav2_msgs/msg/ParticleCloud."""
        cursor = CdrReader(data)
        self._header(cursor)
        return to_planar(cursor.array("<f8", (cursor.count(), 8)).astype(np.float64))

    def path(self, data: bytes) -> Array:
        """(n, 2) x, y of a nav_msgs/msg/Path; every pose but the first is laid out alike."""
        cursor = CdrReader(data)
        self._header(cursor)
        points = np.empty((cursor.count(), 2))
        for row in points:
            self._header(cursor)
            row[:] = cursor.take("7d")[:2]
        return points

    def costmap(self, data: bytes) -> tuple[str, OccupancyGrid]:
        """The frame and the cells of a nav_msgs/msg/OccupancyGrid."""
        cursor = CdrReader(data)
        cursor.take("iI")
        frame = self.names.own(cursor.string())
        cursor.take("iI")
        (resolution,) = cursor.take("f")
        width, height = (int(n) for n in cursor.take("2I"))
        pose = Pose3(*cursor.take("7d"))
        cursor.count()
        cells = cursor.array("i1", (height, width)).astype(np.int8)
        return frame, OccupancyGrid(cells, resolution, Pose2(*pose.plane))

    def _header(self, cursor: CdrReader) -> tuple[int, str]:
        sec, nanosec = cursor.take("iI")
        return self.time.tick(int(sec) * NS_PER_SECOND + int(nanosec)), self.names.own(cursor.string())


def _append_to(messages: LoggedMessages) -> Callable[[int, bytes], None]:
    return lambda tick, data: messages.append((tick, data))
