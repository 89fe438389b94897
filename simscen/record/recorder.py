"""Writes a run to an MCAP log that ROS 2 tools open."""

from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from types import TracebackType

from simscen.core.clock import Clock
from simscen.core.errors import RunError
from simscen.core.records.trace import Moment
from simscen.record import header
from simscen.record.header import LogHeader
from simscen.record.logfile import LogFile
from simscen.record.out import Namespaced, Publisher
from simscen.record.robot_topics import RobotTopics
from simscen.record.sceneryfile import scenery_of
from simscen.record.simtime import SimTime
from simscen.record.writer import McapWriter, Sink


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
        out, time = Publisher(self._writer), SimTime(clock.rate)
        self._writer.note("simscen", header.facts(about, clock))
        for name, data in header.attachments(about).items():
            self._writer.attach(name, header.media_type(name), data)
        each, scenery = about.robots or {"": about}, scenery_of(about)
        first = next(iter(each))
        self.robots = {
            name: RobotTopics(Namespaced(out, name) if name else out, time, one, scenery, name, clock=name == first)
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
            self._writer.attach(header.RESULT, "application/json", result.encode())
        if stack:
            self._writer.note(header.STACK, dict(stack))
        counts = {f"{header.COUNT_PREFIX}{topic}": str(n) for topic, n in sorted(self._writer.message_counts().items())}
        self._writer.note(header.END, {"tick": str(end_tick), **counts})
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
