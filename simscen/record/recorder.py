"""Writes a run to an MCAP log that ROS 2 tools open."""

from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import Protocol

from simscen.core.clock import Clock
from simscen.core.errors import RunError
from simscen.core.records.trace import Moment
from simscen.record import log_header
from simscen.record.log_file import LogFile
from simscen.record.log_header import LogHeader, scenery_from_header
from simscen.record.mcap_writer import McapWriter, Sink
from simscen.record.publishers.channels import LogPublisher, NamespacedPublisher
from simscen.record.publishers.robot import RobotPublisher
from simscen.record.simtime import SimTime


class Recorder:
    """Eats moments in the order of their ticks, those of several robots apart. Equal moments give equal bytes; nothing
    in it is a wall clock.

    Given a path it writes beside it under a partial name until `close`; leaving the context without `close` leaves the
    partial file, with the index that readers ask for unless the disk is full. Given a sink it writes there. Raises
    RunError of kind "output" when the disk does not take it.
    """

    def __init__(self, target: "str | Path | Sink", clock: Clock, about: LogHeader) -> None:
        self._file = LogFile(Path(target)) if isinstance(target, str | Path) else None
        sink = self._file if self._file is not None else target
        assert not isinstance(sink, str | Path)
        self._writer = McapWriter(sink, profile="ros2", library="simscen")
        out, time = LogPublisher(self._writer), SimTime(clock.rate)
        self._writer.note("simscen", log_header.run_metadata(about, clock))
        for name, data in log_header.attachments(about).items():
            self._writer.attach(name, log_header.media_type(name), data)
        each, scenery = about.robots or {"": about}, scenery_from_header(about)
        first = next(iter(each))
        self.robots = {
            name: RobotPublisher(
                NamespacedPublisher(out, name) if name else out, time, one, scenery, name, clock=name == first
            )
            for name, one in each.items()
        }
        """What takes the moments of each robot, by name; the only one has none. The first one tells the time."""

    def append(self, moment: Moment) -> None:
        """Write one beat of the only robot."""
        (robot,) = self.robots.values()
        robot.append(moment)
        self.settle()

    def settle(self) -> None:
        """No moment comes for a while: see to it that a killed run keeps those that came."""
        next(iter(self.robots.values())).settle()

    def close(self, end_tick: int, result: str = "", stack: Mapping[str, str] | None = None) -> None:
        """Write the end of the run, its result (JSON) and what external stacks were, then give the file its name."""
        if result:
            self._writer.attach(log_header.RESULT, "application/json", result.encode())
        if stack:
            self._writer.note(log_header.STACK_RECORD, dict(stack))
        counts = {
            f"{log_header.COUNT_PREFIX}{topic}": str(n) for topic, n in sorted(self._writer.message_counts().items())
        }
        self._writer.note(log_header.END, {"tick": str(end_tick), **counts})
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


MOMENT_DELAY_S = 0.9
"""Seconds for which the moments of a run wait: less than a log of twenty may lose when it is killed."""


class MomentSink(Protocol):
    """Takes the moments of a robot, in order: the MCAP recorder, the trace builder, a progress display."""

    def append(self, moment: Moment) -> None:
        """Take one moment."""
        ...


class Flushable(Protocol):
    """Keeps something back as long as more comes."""

    def settle(self) -> None:
        """Nothing comes for a while."""
        ...


class MomentBuffer:
    """Keeps the moments of all robots in their order, and hands them on when the oldest has waited for so many ticks.

    Between two beats all else runs, so that what writes a moment has left the processor's caches each time: it then
    takes twice as long as for the second of two moments in a row. What waits is lost when the process is killed.
    """

    def __init__(self, ticks: int, file: Flushable | None = None) -> None:
        """0: nothing waits. The `file` behind the logs is told each time that all which waited has been handed on."""
        self.waiting: list[tuple[tuple[MomentSink, ...], Moment]] = []
        self._file = file
        self.ticks, self.until = ticks, 0

    def before(self, *logs: MomentSink) -> MomentSink:
        """What takes the moments of a robot for these logs."""
        return _RobotSink(self, logs)

    def flush(self) -> None:
        """Hand on all that waits."""
        waiting, self.waiting = self.waiting, []
        for logs, moment in waiting:
            for log in logs:
                log.append(moment)
        if self._file is not None:
            self._file.settle()

    def __enter__(self) -> "MomentBuffer":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is not None:
            with suppress(RunError):  # why the run broke off is worth more than that its log did, too
                self.flush()


class _RobotSink:
    """One robot's way into the backlog."""

    def __init__(self, backlog: MomentBuffer, logs: tuple[MomentSink, ...]) -> None:
        self._backlog, self._logs = backlog, logs

    def append(self, moment: Moment) -> None:
        """Let it wait for the next ones, unless the oldest has waited long enough."""
        backlog, tick = self._backlog, moment.tick
        backlog.waiting.append((self._logs, moment))
        if tick >= backlog.until:
            backlog.until = tick + backlog.ticks
            backlog.flush()
