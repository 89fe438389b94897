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

    The trace of a truncated log has no event `run.ended`. With `with_sensors`, also keep scans, particles, local plans,
    costmaps, and the map. Raises InvalidInput if the log cannot be used.
    """
    with unusable_log_as_invalid_input(path):
        roles = topic_roles(options)
        collector = SensorMessageCollector() if with_sensors else None
        messages = open_messages(path, (*roles, *SENSOR_TOPICS) if with_sensors else roles)
        decoded = decode_messages(messages if collector is None else collector.collect(messages), roles)
        with np.errstate(all="ignore"):  # the judge reports numbers that are not finite
            reader = ForeignTraceReader(decoded, messages.topics, options)
        reader.notes += invalid_pose_notes(decoded.invalid_poses)
        end = reader.time.end
        if messages.complete:
            reader.rows.events.append(Event(end, EventKind.RUN_ENDED, "the recording ends"))
        else:
            reader.notes.append("the log is truncated, so no criterion can pass")
        trace = reader.rows.trace(options.tick_rate, end)
        coverage = LogCoverage(reader.missing, reader.partial, recorded_by_simscen=False)
        if collector is None:
            return ForeignLog(trace, coverage, reader.notes)
        return ForeignLog(trace, coverage, reader.notes, collector.sensors(reader.time, decoded), collector.map)


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
    """Collects sensor messages while another reader iterates over the messages of a log.

    `map` is the last map on /map; None without a map.
    """

    def __init__(self) -> None:
        self.map: OccupancyGrid | None = None
        self._sensors = SensorMessages(stamps_are_run_times=False)
        self._messages: list[RawMessage] = []

    def collect(self, messages: Iterable[RawMessage]) -> Iterator[RawMessage]:
        """Yield all messages, and collect the sensor messages. Raises ValueError for an invalid sensor message.

        Plans with an invalid orientation are ignored.
        """
        for message in messages:
            if message.encoding == "cdr":
                with suppress(InvalidOrientation):
                    self._add(message)
            yield message

    def sensors(self, time: Timebase, decoded: DecodedMessages) -> SensorMessages:
        """Return the collected messages with ticks of the timebase, and the mounts of lidars."""
        ticks = time.ticks_of_logged(np.array([message.time for message in self._messages], dtype=np.int64))
        for tick, message in zip(ticks.tolist(), self._messages, strict=True):
            handler = self._sensors.handler(message.topic, message.type)
            assert handler is not None
            handler(tick, message.data)
        transforms = transform_tree(decoded)
        for frame in transforms.child_frames:
            if (mount := transforms.sensor_mount(frame, BASE_FRAME)) is not None:
                level = Pose3.planar(mount.plane)
                self._sensors.mounts[frame] = level.compose(_UPSIDE_DOWN) if is_upside_down(mount) else level
        return self._sensors

    def _add(self, message: RawMessage) -> None:
        if (message.topic, message.type) == topics.MAP[:2]:
            self.map = self._sensors.decode_costmap(message.data)[1]
        elif self._sensors.handler(message.topic, message.type) is not None:
            checks: dict[str, Callable[[bytes], object]] = {
                topics.SCAN_TYPE: self._sensors.decode_scan,
                topics.PARTICLES.type: self._sensors.decode_particles,
                topics.LOCAL_PLAN.type: self._sensors.decode_path,
                topics.MAP.type: self._sensors.decode_costmap,
            }
            checks[message.type](message.data)  # raises ValueError for an invalid message
            self._messages.append(message)
