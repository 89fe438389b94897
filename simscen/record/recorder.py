"""Recording of a run to an MCAP log that ROS 2 tools can open, and a buffer of moments for faster writing."""

from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Protocol

from simscen.core.clock import Clock, SimTime
from simscen.core.errors import RunError
from simscen.core.records.trace import Moment
from simscen.record import log_header
from simscen.record.log_file import LogFile
from simscen.record.log_header import LogHeader, scenery_from_header
from simscen.record.mcap_writer import McapWriter, Sink
from simscen.record.publishers.channels import LogPublisher, NamespacedPublisher
from simscen.record.publishers.robot import RobotPublisher


class Recorder:
    """Writes the moments of each robot in the order of their ticks. Equal moments give equal bytes.

    `header` describes the run. `target` is the path of the log, or a sink for its bytes. A log file has a partial name
    until `close`; leaving the context without `close` keeps the partial file, with an index unless the disk is full.
    Raises RunError of kind "output" if the log cannot be written.
    """

    def __init__(self, target: "str | Path | Sink", clock: Clock, header: LogHeader) -> None:
        self._file = LogFile(Path(target)) if isinstance(target, str | Path) else None
        sink = self._file if self._file is not None else target
        assert not isinstance(sink, str | Path)
        self._writer = McapWriter(sink, profile="ros2", library="simscen")
        out, time = LogPublisher(self._writer), SimTime(clock.rate)
        self._writer.add_metadata("simscen", log_header.run_metadata(header, clock))
        for name, data in log_header.attachments(header).items():
            self._writer.add_attachment(name, log_header.media_type(name), data)
        headers, scenery = header.robots or {"": header}, scenery_from_header(header)
        first = next(iter(headers))
        self.robots = {
            name: RobotPublisher(
                NamespacedPublisher(out, name) if name else out, time, robot, scenery, name, clock=name == first
            )
            for name, robot in headers.items()
        }
        """Publishers by robot name ("" for a single robot). The first one also publishes /clock."""

    def append(self, moment: Moment) -> None:
        """Write one moment of a single robot."""
        (robot,) = self.robots.values()
        robot.append(moment)
        self.flush_if_due()

    def flush_if_due(self) -> None:
        """Write buffered messages to the file if there are enough, so that a killed run loses little."""
        next(iter(self.robots.values())).flush_if_due()

    def close(self, end_tick: int, result: str = "", stack: Mapping[str, str] | None = None) -> None:
        """Write the result (JSON), the facts on external stacks and the end record, then give the file its name."""
        if result:
            self._writer.add_attachment(log_header.RESULT, "application/json", result.encode())
        if stack:
            self._writer.add_metadata(log_header.STACK_RECORD, dict(stack))
        counts = {
            f"{log_header.COUNT_PREFIX}{topic}": str(n) for topic, n in sorted(self._writer.message_counts().items())
        }
        self._writer.add_metadata(log_header.END, {"tick": str(end_tick), **counts})
        self._writer.finish()
        if self._file is not None:
            self._file.finish()
            self._file = None

    def __enter__(self) -> "Recorder":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        if self._file is not None:
            if not self._file.failed:
                with suppress(RunError):  # the exception that aborted the run is more important
                    self._writer.finish()
            self._file.abandon()


MOMENT_DELAY_S = 0.9
"""Maximum simulated time for which moments are buffered."""


class MomentSink(Protocol):
    """Receives the moments of a robot in order: the MCAP recorder, the trace builder, a progress display."""

    def append(self, moment: Moment) -> None:
        """Process one moment."""
        ...


class Flushable(Protocol):
    """Buffers its output."""

    def flush_if_due(self) -> None:
        """Write the buffer if it is large enough."""
        ...


class MomentBuffer:
    """Buffers the moments of all robots in their order and writes them in batches.

    Writing several moments in a row halves the time for each, because the code and data stay in the processor's caches.
    Buffered moments are lost if the process is killed.
    """

    def __init__(self, ticks: int, file: Flushable | None = None) -> None:
        """Buffer moments for at most `ticks` (0: no buffering). `file` is flushed after each batch, if due."""
        self.pending: list[tuple[tuple[MomentSink, ...], Moment]] = []
        self._file = file
        self.ticks, self.next_flush_tick = ticks, 0

    def sink(self, *logs: MomentSink) -> MomentSink:
        """Return a sink that buffers the moments of one robot for these logs."""
        return _BufferedSink(self, logs)

    def flush(self) -> None:
        """Write all buffered moments."""
        pending, self.pending = self.pending, []
        for logs, moment in pending:
            for log in logs:
                log.append(moment)
        if self._file is not None:
            self._file.flush_if_due()

    def __enter__(self) -> "MomentBuffer":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        if kind is not None:
            with suppress(RunError):  # the exception that aborted the run is more important
                self.flush()


class _BufferedSink:
    """Adds the moments of one robot to a MomentBuffer."""

    def __init__(self, buffer: MomentBuffer, logs: tuple[MomentSink, ...]) -> None:
        self._buffer, self._logs = buffer, logs

    def append(self, moment: Moment) -> None:
        """Buffer a moment, and flush the buffer if its oldest moment is old enough."""
        buffer, tick = self._buffer, moment.tick
        buffer.pending.append((self._logs, moment))
        if tick >= buffer.next_flush_tick:
            buffer.next_flush_tick = tick + buffer.ticks
            buffer.flush()
