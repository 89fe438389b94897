"""Moments that wait until several can be written at once."""

from contextlib import suppress
from types import TracebackType
from typing import Protocol

from simscen.core.errors import RunError
from simscen.core.records.trace import Moment

WAITS = 0.9
"""Seconds for which the moments of a run wait: less than a log of twenty may lose when it is killed."""


class Log(Protocol):
    """Takes the moments of a robot, in order: the MCAP recorder, the trace builder, a progress display."""

    def append(self, moment: Moment) -> None:
        """Take one moment."""
        ...


class Settling(Protocol):
    """Keeps something back as long as more comes."""

    def settle(self) -> None:
        """Nothing comes for a while."""
        ...


class Backlog:
    """Keeps the moments of all robots in their order, and hands them on when the oldest has waited for so many ticks.

    Between two beats all else runs, so that what writes a moment has left the processor's caches each time: it then
    takes twice as long as for the second of two moments in a row. What waits is lost when the process is killed.
    """

    def __init__(self, ticks: int, file: Settling | None = None) -> None:
        """0: nothing waits. The `file` behind the logs is told each time that all which waited has been handed on."""
        self.waiting: list[tuple[tuple[Log, ...], Moment]] = []
        self._file = file
        self.ticks, self.until = ticks, 0

    def before(self, *logs: Log) -> Log:
        """What takes the moments of a robot for these logs."""
        return _Robot(self, logs)

    def flush(self) -> None:
        """Hand on all that waits."""
        waiting, self.waiting = self.waiting, []
        for logs, moment in waiting:
            for log in logs:
                log.append(moment)
        if self._file is not None:
            self._file.settle()

    def __enter__(self) -> "Backlog":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if kind is not None:
            with suppress(RunError):  # why the run broke off is worth more than that its log did, too
                self.flush()


class _Robot:
    """One robot's way into the backlog."""

    def __init__(self, backlog: Backlog, logs: tuple[Log, ...]) -> None:
        self._backlog, self._logs = backlog, logs

    def append(self, moment: Moment) -> None:
        """Let it wait for the next ones, unless the oldest has waited long enough."""
        backlog, tick = self._backlog, moment.tick
        backlog.waiting.append((self._logs, moment))
        if tick >= backlog.until:
            backlog.until = tick + backlog.ticks
            backlog.flush()
