"""Messages of a log that replays show in addition to the trace: scans, particles, local plans, costmaps, log lines."""

from collections.abc import Callable
from dataclasses import dataclass, field

from simscen.core.clock import Clock
from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.geometry import Array, Pose3
from simscen.core.messages.sensor_data import Scan, level_scan
from simscen.core.records.trace import LogLine
from simscen.record import topics
from simscen.record.frame_names import RobotFrames
from simscen.record.messages import decode
from simscen.record.messages.decode import MessageReader
from simscen.record.messages.event_text import EVENT_LOGGER
from simscen.record.trace_builder import to_planar

LoggedMessages = list[tuple[int, bytes]]
"""List of pairs: tick of logging, and serialized message."""


@dataclass(eq=False)
class SensorMessages:
    """Serialized messages of one robot, and methods that decode them.

    Attributes:
        clock: Clock of the log.
        scans: Scans by topic.
        particles: Particle clouds.
        local_plans: Local plans.
        costmaps: Costmaps by topic.
        mounts: Poses of sensors on the base, by the name of the sensor's frame in the stack.
        log_lines: Messages of /rosout, including the lines that simscen writes for its events.
        stamps_are_run_times: Whether stamps count from the start of the run. If not, use the ticks of logging.
        frames: Names of the robot's frames in the log. Decoded messages have the frame names of the stack instead.
    """

    clock: Clock = field(default_factory=lambda: Clock(1))
    scans: dict[str, LoggedMessages] = field(default_factory=dict)
    particles: LoggedMessages = field(default_factory=list)
    local_plans: LoggedMessages = field(default_factory=list)
    costmaps: dict[str, LoggedMessages] = field(default_factory=dict)
    mounts: dict[str, Pose3] = field(default_factory=dict)
    log_lines: LoggedMessages = field(default_factory=list)
    stamps_are_run_times: bool = True
    frames: RobotFrames = field(default_factory=RobotFrames)

    def handler(self, topic: str, message_type: str) -> Callable[[int, bytes], None] | None:
        """Return a function that stores a message of a topic; None if messages of the topic are not stored.

        The arguments of the function are the tick of logging and the serialized message.
        """
        if message_type == topics.SCAN_TYPE:
            return _append_to(self.scans.setdefault(topic, []))
        if (topic, message_type) == topics.PARTICLES[:2]:
            return _append_to(self.particles)
        if (topic, message_type) == topics.LOCAL_PLAN[:2]:
            return _append_to(self.local_plans)
        if message_type == topics.MAP.type and topic.endswith("costmap/costmap"):
            return _append_to(self.costmaps.setdefault(topic, []))
        return None

    def decode_scan(self, data: bytes) -> Scan:
        """Decode a LaserScan. The scan of a tilted lidar is converted to a level scan, see `level_scan`."""
        scan = decode.laser_scan(MessageReader(data))
        frame = self.frames.stack_frame(scan.frame)
        limits = scan.angle_min, scan.angle_increment, scan.range_min, scan.range_max
        mount = self.mounts.get(frame, Pose3())
        tilted = None if mount.is_level else mount
        return level_scan(Scan(frame, self.clock.tick_at(scan.stamp), scan.ranges, *limits, mount.plane, tilted))

    def decode_particles(self, data: bytes) -> Array:
        """Decode a ParticleCloud to poses (n, 3) x, y, yaw."""
        return to_planar(decode.particle_cloud(MessageReader(data)))

    def decode_path(self, data: bytes) -> Array:
        """Decode a Path to points (n, 2) x, y."""
        return decode.path(MessageReader(data)).poses[:, :2]

    def stack_lines(self) -> list[tuple[int, LogLine]]:
        """Return the log lines of an external stack, each with its tick of logging."""
        decoded = [(tick, decode.log_line(MessageReader(data))) for tick, data in self.log_lines]
        return [(tick, line) for tick, line in decoded if line.name != EVENT_LOGGER]

    def decode_costmap(self, data: bytes) -> tuple[str, OccupancyGrid]:
        """Decode an OccupancyGrid to its frame and the grid."""
        frame, grid = decode.occupancy_grid(MessageReader(data))
        return self.frames.stack_frame(frame), grid


def _append_to(messages: LoggedMessages) -> Callable[[int, bytes], None]:
    return lambda tick, data: messages.append((tick, data))
