"""Buffer that passes moments (the records of single ticks) to the recorder and the trace builder in batches."""

from contextlib import suppress
from types import TracebackType
from typing import Protocol

from simscen.core.errors import RunError
from simscen.core.records.trace import Moment

MOMENT_DELAY_S = 0.9
"""Maximum simulated time for which moments are buffered. The buffered moments are lost if the process is killed."""


class MomentSink(Protocol):
    """Receiver of the moments of a robot in order, such as a recorder, a trace builder, or a progress display."""

    def append(self, moment: Moment) -> None:
        """Process one moment."""
        ...


class Flushable(Protocol):
    """Output with its own buffer, such as a Recorder."""

    def flush_if_due(self) -> None:
        """Write the buffered output if it is large enough."""
        ...


class MomentBuffer:
    """Buffers the moments of all robots, and passes the moments on in batches, which is faster.

    If an exception leaves the context of this context manager, the buffer is flushed. The context manager does not
    flush after a normal end.
    """

    def __init__(self, ticks: int, file: Flushable | None = None) -> None:
        """Buffer moments for at most `ticks` (0 = no buffering). `file.flush_if_due` is called after each batch."""
        self.pending: list[tuple[tuple[MomentSink, ...], Moment]] = []
        self._file = file
        self.ticks, self.next_flush_tick = ticks, 0

    def sink(self, *sinks: MomentSink) -> MomentSink:
        """Return a sink that buffers the moments of one robot, and passes each moment to all `sinks` when flushed."""
        return _BufferedSink(self, sinks)

    def flush(self) -> None:
        """Pass on all buffered moments."""
        pending, self.pending = self.pending, []
        for sinks, moment in pending:
            for sink in sinks:
                sink.append(moment)
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

    def __init__(self, buffer: MomentBuffer, sinks: tuple[MomentSink, ...]) -> None:
        self._buffer, self._sinks = buffer, sinks

    def append(self, moment: Moment) -> None:
        """Buffer a moment, and flush the buffer when its period is over."""
        buffer, tick = self._buffer, moment.tick
        buffer.pending.append((self._sinks, moment))
        if tick >= buffer.next_flush_tick:
            buffer.next_flush_tick = tick + buffer.ticks
            buffer.flush()
