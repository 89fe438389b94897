"""Writes a run to an MCAP log that ROS 2 tools open."""

from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from types import TracebackType

from simscen.core.errors import RunError
from simscen.core.geometry import Pose3
from simscen.core.time import Clock
from simscen.core.trace import Moment
from simscen.record import frames, header, pack_many, pack_rare, topics
from simscen.record.event_topics import EventTopics
from simscen.record.header import LogHeader
from simscen.record.logfile import LogFile
from simscen.record.sensor_topics import SensorTopics
from simscen.record.simtime import SimTime
from simscen.record.stack_topics import StackTopics
from simscen.record.thinning import Thinning
from simscen.record.topics import Publisher
from simscen.record.truth_topics import TruthTopics
from simscen.record.writer import McapWriter, Sink


class Recorder:
    """Eats moments in the order of their ticks. Equal moments give equal bytes; nothing in it is a wall clock.

    Given a path it writes beside it under a partial name until `close`; leaving the context without `close` leaves the
    partial file, with the index that readers ask for unless the disk is full. Given a sink it writes there. Raises
    RunError of kind "output" when the disk does not take it.
    """

    def __init__(self, target: "str | Path | Sink", clock: Clock, about: LogHeader) -> None:
        self._file = LogFile(Path(target)) if isinstance(target, str | Path) else None
        sink = self._file if self._file is not None else target
        assert not isinstance(sink, str | Path)
        self._writer = McapWriter(sink, profile="ros2", library="simscen")
        self._time = SimTime(clock.rate)
        out, thinning = Publisher(self._writer), Thinning(clock.rate)
        _write_header(self._writer, out, clock, about)
        self._truth = TruthTopics(out, self._time, thinning)
        self._sensors = SensorTopics(out, self._time, thinning, about.frames, about.sensors)
        self._stack = StackTopics(out, self._time, thinning)
        self._events = EventTopics(out, self._time, about.case)

    def append(self, moment: Moment) -> None:
        """Write one beat; every message of it carries the beat's simulated time."""
        tick, decision = moment.tick, moment.decision
        now = self._time.nanoseconds(tick)
        if moment.truth is not None:
            self._truth.write(now, tick, moment.truth)
        if decision.belief is not None:
            self._sensors.correct(Pose3.planar(decision.belief.map_from_odom))
        self._sensors.write(now, moment.readings)
        self._stack.write(now, tick, decision)
        for event in (*moment.events, *decision.events):
            self._events.write(now, event)

    def close(self, end_tick: int, result: str = "", stack: Mapping[str, str] | None = None) -> None:
        """Write the end of the run, its result (JSON) and what an external stack was, then give the file its name."""
        if result:
            self._writer.attach(header.RESULT, "application/json", result.encode())
        if stack:
            self._writer.note(header.STACK, dict(stack))
        self._writer.note("simscen.end", {"tick": str(end_tick)})
        self._writer.finish()
        if self._file is not None:
            self._file.finish()
            self._file = None

    def __enter__(self) -> "Recorder":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._file is not None:
            if not self._file.failed:
                with suppress(RunError):  # why the run broke off is worth more than that its log did, too
                    self._writer.finish()
            self._file.abandon()


def _write_header(writer: McapWriter, out: Publisher, clock: Clock, about: LogHeader) -> None:
    writer.note("simscen", header.facts(about, clock))
    for name, data in header.attachments(about).items():
        writer.attach(name, header.media_type(name), data)
    if about.map is not None:
        out.publish(topics.MAP, 0, pack_many.occupancy_grid(frames.MAP, (0, 0), about.map))
    if about.robot_description:
        out.publish(topics.ROBOT_DESCRIPTION, 0, pack_rare.string(about.robot_description))
