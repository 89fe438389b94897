"""Reader of a real robot's log: converts messages on standard topics to a Trace, and lists missing evidence."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.geometry import Pose3
from simscen.core.records.events import Event, EventKind
from simscen.core.records.trace import Trace
from simscen.core.records.verdict import LogCoverage
from simscen.record import topics
from simscen.record.foreign.decoded_messages import DecodedMessages, decode_messages, topic_roles
from simscen.record.foreign.options import ForeignLogOptions
from simscen.record.foreign.raw_messages import (
    RawMessage,
    invalid_pose_notes,
    open_messages,
    unusable_log_as_invalid_input,
)
from simscen.record.foreign.timebase import Timebase
from simscen.record.foreign.trace_reader import ForeignTraceReader
from simscen.record.foreign.tracks import transform_tree
from simscen.record.foreign.transforms import is_upside_down
from simscen.record.messages.decode import InvalidOrientation
from simscen.record.sensor_messages import SensorMessages


@dataclass(frozen=True, eq=False)
class ForeignLog:
    """Log of a real robot.

    trace:     recorded signals and events
    coverage:  evidence (kinds of information) that is missing or that covers only a part of the time
    notes:     remarks for the user
    sensors:   sensor messages for replays; empty unless requested
    map:       map for replays; None unless requested, or if the log has no map
    """

    trace: Trace
    coverage: LogCoverage
    notes: Sequence[str]
    sensors: SensorMessages = field(default_factory=SensorMessages)
    map: OccupancyGrid | None = None


def read_foreign_log(path: Path, options: ForeignLogOptions, with_sensors: bool = False) -> ForeignLog:
    """Read an MCAP file or a rosbag2 folder of a real robot.

    The trace of a truncated log has no event `run.ended`. If `with_sensors` is True, the result also has the scans,
    particles, local plans, costmaps, and the map. Raises InvalidInput if the log cannot be used.
    """
    with unusable_log_as_invalid_input(path):
        roles = topic_roles(options)
        collector = SensorMessageCollector() if with_sensors else None
        messages = open_messages(path, (*roles, *SENSOR_TOPICS) if with_sensors else roles)
        decoded = decode_messages(messages if collector is None else collector.collect(messages), roles)
        with np.errstate(all="ignore"):  # the judge reports numbers that are not finite
            reader = ForeignTraceReader(decoded, messages.topics, options)
        reader.notes += invalid_pose_notes(decoded.invalid_poses)
        last_tick = reader.timebase.last_tick
        if messages.is_complete:
            reader.rows.events.append(Event(last_tick, EventKind.RUN_ENDED, "the recording ends"))
        else:
            reader.notes.append("the log is truncated, so no criterion can pass")
        trace = reader.rows.trace(options.tick_rate, last_tick)
        coverage = LogCoverage(reader.missing, reader.partial, recorded_by_simscen=False)
        if collector is None:
            return ForeignLog(trace, coverage, reader.notes)
        sensors = collector.sensor_messages(reader.timebase, decoded)
        return ForeignLog(trace, coverage, reader.notes, sensors, collector.map)


SENSOR_TOPICS = (
    "/scan",
    *(topic.name for topic in (topics.PARTICLES, topics.LOCAL_PLAN, topics.MAP)),
    *(topic.name for topic in (topics.GLOBAL_COSTMAP, topics.LOCAL_COSTMAP)),
)
"""Topics for replays. In MCAP files, scans on other topics are read as well."""
BASE_FRAME = "base_link"
"""Frame in which replays need the poses of lidars."""
_UPSIDE_DOWN = Pose3(qx=1.0, qw=0.0)
"""Rotation by 180° about the x axis."""


class SensorMessageCollector:
    """Collects the sensor messages of a log while another reader iterates over all messages.

    `map` is the last map on /map; None if the log has no map.
    """

    def __init__(self) -> None:
        self.map: OccupancyGrid | None = None
        self._sensors = SensorMessages(stamps_are_run_times=False)
        self._messages: list[RawMessage] = []

    def collect(self, messages: Iterable[RawMessage]) -> Iterator[RawMessage]:
        """Yield all messages, and collect the sensor messages. Raises ValueError for an invalid sensor message.

        Local plans with an invalid orientation are not collected.
        """
        for message in messages:
            if message.encoding == "cdr":
                with suppress(InvalidOrientation):
                    self._add(message)
            yield message

    def sensor_messages(self, timebase: Timebase, decoded: DecodedMessages) -> SensorMessages:
        """Return the collected messages with their ticks, and the mounts of lidars from the transforms in `decoded`."""
        ticks = timebase.ticks_of_logged(np.array([message.time for message in self._messages], dtype=np.int64))
        for tick, message in zip(ticks.tolist(), self._messages, strict=True):
            handler = self._sensors.handler(message.topic, message.type)
            assert handler is not None
            handler(tick, message.data)
        transforms = transform_tree(decoded)
        for frame in transforms.child_frames:
            if (mount := transforms.sensor_mount(frame, BASE_FRAME)) is not None:
                level_mount = Pose3.planar(mount.plane)
                is_mirrored = is_upside_down(mount)
                self._sensors.mounts[frame] = level_mount.compose(_UPSIDE_DOWN) if is_mirrored else level_mount
        return self._sensors

    def _add(self, message: RawMessage) -> None:
        if (message.topic, message.type) == topics.MAP[:2]:
            self.map = self._sensors.decode_costmap(message.data)[1]
        elif self._sensors.handler(message.topic, message.type) is not None:
            decoders: dict[str, Callable[[bytes], object]] = {
                topics.SCAN_TYPE: self._sensors.decode_scan,
                topics.PARTICLES.type: self._sensors.decode_particles,
                topics.LOCAL_PLAN.type: self._sensors.decode_path,
                topics.MAP.type: self._sensors.decode_costmap,
            }
            decoders[message.type](message.data)  # raises ValueError for an invalid message
            self._messages.append(message)
