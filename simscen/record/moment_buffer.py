"""Buffer that passes moments (the records of single ticks) to the recorder and the trace builder in batches."""

from contextlib import suppress
from types import TracebackType
from typing import Protocol

from simscen.core.errors import RunError
from simscen.core.records.trace import Moment

MOMENT_DELAY_S = 0.9
"""Maximum simulated time for which moments are buffered. Buffered moments are lost if the process is killed."""


class MomentSink(Protocol):
    """Receives the moments of a robot in order: a recorder, a trace builder, or a progress display."""

    def append(self, moment: Moment) -> None:
        """Process one moment."""
        ...


class Flushable(Protocol):
    """Output with its own buffer, such as a Recorder."""

    def flush_if_due(self) -> None:
        """Write the buffered output if it is large enough."""
        ...


class MomentBuffer:
    """Buffers the moments of all robots, and passes them on in batches, which is faster.

    As a context manager, it flushes the buffer if an exception leaves the context.
    """

    def __init__(self, ticks: int, file: Flushable | None = None) -> None:
        """Buffer moments for at most `ticks` (0 = no buffering). `file.flush_if_due` is called after each batch."""
        self.pending: list[tuple[tuple[MomentSink, ...], Moment]] = []
        self._file = file
        self.ticks, self.next_flush_tick = ticks, 0

    def sink(self, *logs: MomentSink) -> MomentSink:
        """Return a sink that passes the moments of one robot to each of `logs`."""
        return _BufferedSink(self, logs)

    def flush(self) -> None:
        """Pass on all buffered moments."""
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
        """Buffer a moment, and flush the buffer if it is due."""
        buffer, tick = self._buffer, moment.tick
        buffer.pending.append((self._logs, moment))
        if tick >= buffer.next_flush_tick:
            buffer.next_flush_tick = tick + buffer.ticks
            buffer.flush()
