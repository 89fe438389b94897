"""Recorder of a run: writes an MCAP log that ROS 2 tools can open."""

from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from types import TracebackType

from simscen.core.clock import Clock
from simscen.core.errors import RunError
from simscen.core.records.trace import Moment
from simscen.record import log_header
from simscen.record.log_file import LogFile
from simscen.record.log_header import LogHeader, scenery_from_header
from simscen.record.mcap_writer import McapWriter, Sink
from simscen.record.publishers.message_sinks import LogPublisher
from simscen.record.publishers.robot import RobotPublisher


class Recorder:
    """Context manager that writes the moments (records of single ticks) of all robots to a log.

    `target` is the path of the log, or a sink for the bytes of the log. `header` describes the run. The name of a log
    file ends with `.partial.mcap` until `close`. It keeps this name if the run is aborted. Methods raise RunError of
    kind "output" if the log cannot be written.
    """

    def __init__(self, target: "str | Path | Sink", clock: Clock, header: LogHeader) -> None:
        self._file = LogFile(Path(target)) if isinstance(target, str | Path) else None
        sink = self._file if self._file is not None else target
        assert not isinstance(sink, str | Path)
        self._writer = McapWriter(sink, profile="ros2", library="simscen")
        self._writer.add_metadata(log_header.RUN_RECORD, log_header.run_metadata(header, clock))
        for name, data in log_header.attachments(header).items():
            self._writer.add_attachment(name, log_header.media_type(name), data)
        headers, scenery = header.robots or {"": header}, scenery_from_header(header)
        first = next(iter(headers))
        self.robots = {
            name: RobotPublisher(LogPublisher(self._writer, name), clock, robot, scenery, name, name == first)
            for name, robot in headers.items()
        }
        """Publishers by robot name ("" for a single robot). The first one also publishes /clock."""

    def append(self, moment: Moment) -> None:
        """Write one moment of a run with a single robot. With several robots, use `robots[name].append`."""
        (robot,) = self.robots.values()
        robot.append(moment)
        self.flush_if_due()

    def flush_if_due(self) -> None:
        """Write the buffered messages to the file if they are large enough or cover enough time."""
        self._writer.flush_if_due()

    def close(self, end_tick: int, result: str = "", stack: Mapping[str, str] | None = None) -> None:
        """Write the last records, and give the file its final name.

        `result` is the content of result.json, or "" if there is none. `stack` are facts about external stacks.
        """
        if result:
            self._writer.add_attachment(log_header.RESULT_FILE, "application/json", result.encode())
        if stack:
            self._writer.add_metadata(log_header.STACK_RECORD, dict(stack))
        counts = {
            f"{log_header.COUNT_PREFIX}{topic}": str(n) for topic, n in sorted(self._writer.message_counts().items())
        }
        self._writer.add_metadata(log_header.END_RECORD, {"tick": str(end_tick), **counts})
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
            if not self._file.has_failed:
                with suppress(RunError):  # the exception that aborted the run is more important
                    self._writer.finish()
            self._file.abandon()
