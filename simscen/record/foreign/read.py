"""Reads a log of others into a Trace, and says what it lacks."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.geometry import Pose2, Pose3
from simscen.core.records.events import Event, EventKind
from simscen.core.records.trace import Trace
from simscen.core.records.verdict import LogCoverage
from simscen.record import topics
from simscen.record.foreign.decoded import DecodedMessages, decode_messages, topic_roles
from simscen.record.foreign.options import ForeignLogOptions
from simscen.record.foreign.raw_messages import RawMessage, UnusableLog, open_messages
from simscen.record.foreign.timebase import Timebase
from simscen.record.foreign.trace_reader import ForeignTraceReader
from simscen.record.foreign.transforms import lidar_mount
from simscen.record.log_reader.read import LOG_READ_ERRORS, invalid_log
from simscen.record.log_reader.sensor_messages import SensorMessages


@dataclass(frozen=True, eq=False)
class ForeignLog:
    """A log of others: its trace, what it lacks, and what about it is odd, in words for its owner.

    `seen` and `map` are what no trace holds; nothing unless it was asked for.
    """

    trace: Trace
    coverage: LogCoverage
    notes: Sequence[str]
    seen: SensorMessages = field(default_factory=SensorMessages)
    map: OccupancyGrid | None = None


def read_foreign_log(path: Path, wanted: ForeignLogOptions, looks: bool = False) -> ForeignLog:
    """Read an MCAP file or a rosbag2 folder of a real robot.

    The trace lasts from the first to the last message that is wanted. One that was cut off has no `run.ended`, so that
    nothing passes on it. With `looks`, scans, particles, local plans, costmaps and the map are kept, too. Raises
    InvalidInput, with the reason, for what cannot be used.
    """
    try:
        roles = topic_roles(wanted)
        watched = SensorMessageCollector() if looks else None
        messages = open_messages(path, (*roles, *SENSOR_TOPICS) if looks else roles)
        found = decode_messages(messages if watched is None else watched.among(messages), roles)
        with np.errstate(all="ignore"):  # what is not finite is found and named by whoever judges it
            reading = ForeignTraceReader(found, messages.topics, wanted)
        end = reading.time.end
        if messages.complete:
            reading.rows.events.append(Event(end, EventKind.RUN_ENDED, "the recording ends"))
        else:
            reading.notes.append("the log breaks off, so nothing passes on it")
        trace = reading.rows.trace(wanted.tick_rate, end)
        coverage = LogCoverage(reading.missing, reading.partial, recorded_by_simscen=False)
        if watched is None:
            return ForeignLog(trace, coverage, reading.notes)
        return ForeignLog(trace, coverage, reading.notes, watched.seen(reading.time, found), watched.map)
    except UnusableLog as error:
        raise invalid_log(path, "SC804", str(error), error.hint) from error
    except OSError as error:
        raise invalid_log(path, "SC800", f"cannot read the log: {error.strerror or error}") from error
    except LOG_READ_ERRORS as error:
        raise invalid_log(path, "SC802", f"the log is damaged: {error or type(error).__name__}") from error


SENSOR_TOPICS = (
    "/scan",
    *(topic.name for topic in (topics.PARTICLES, topics.LOCAL_PLAN, topics.MAP)),
    *(topic.name for topic in (topics.GLOBAL_COSTMAP, topics.LOCAL_COSTMAP)),
)
"""What is read of a bag whose other topics are left alone; an MCAP file shows lidars under any name."""
BASE = "base_link"


class SensorMessageCollector:
    """Keeps messages that there is something to see in, while others read them; `map` is the last map."""

    def __init__(self) -> None:
        self.map: OccupancyGrid | None = None
        self._seen = SensorMessages(stamped=False)
        self._kept: list[RawMessage] = []

    def among(self, messages: Iterable[RawMessage]) -> Iterator[RawMessage]:
        """The same messages. Raises struct.error and ValueError for one that cannot be read."""
        for message in messages:
            if message.encoding == "cdr":
                self._look_at(message)
            yield message

    def seen(self, time: Timebase, found: DecodedMessages) -> SensorMessages:
        """All of them at their ticks, with lidars where static transforms say."""
        ticks = time.of_logged(np.array([message.time for message in self._kept], dtype=np.int64))
        for tick, message in zip(ticks.tolist(), self._kept, strict=True):
            take = self._seen.taker(message.topic, message.type)
            assert take is not None
            take(tick, message.data)
        links = {posed.child: posed for _, told in found.said["tf_static"] for posed in told}
        for frame in links:
            if (mount := lidar_mount(frame, BASE, links)) is not None:
                self._seen.mounts[frame] = Pose3.planar(Pose2(*mount.pose))
        return self._seen

    def _look_at(self, message: RawMessage) -> None:
        if (message.topic, message.type) == topics.MAP[:2]:
            self.map = self._seen.costmap(message.data)[1]
        elif self._seen.taker(message.topic, message.type) is not None:
            self._try(message)
            self._kept.append(message)

    def _try(self, message: RawMessage) -> None:
        """Read it now: whoever looks at it later need not be ready for damage."""
        match message.type:
            case topics.SCAN_TYPE:
                self._seen.scan(message.data)
            case topics.PARTICLES.type:
                self._seen.cloud(message.data)
            case topics.LOCAL_PLAN.type:
                self._seen.path(message.data)
            case _:
                self._seen.costmap(message.data)
