"""Reader of logs that simscen recorded."""

import struct
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO

from mcap.exceptions import McapError
from zstandard import ZstdError

from simscen.core.errors import InvalidInput, Problem
from simscen.core.records.trace import Trace
from simscen.core.records.verdict import COMPLETE_COVERAGE, LogCoverage
from simscen.record import topics
from simscen.record.log_contents import LogContents, NotSimscenLog
from simscen.record.log_file import PARTIAL_SUFFIX
from simscen.record.log_header import LogHeader
from simscen.record.mcap_reader import RecordReader, is_mcap, open_log
from simscen.record.sensor_messages import SensorMessages

_READ_ERRORS = (
    McapError,
    ZstdError,
    struct.error,
    ValueError,
    TypeError,
    LookupError,
    ArithmeticError,
    MemoryError,
    RecursionError,
)
"""Exceptions that libraries and decoders raise for damaged files."""


def invalid_log(path: Path, code: str, message: str, hint: str = "") -> InvalidInput:
    """Return the exception for a problem with a log. `code` is the error code, such as "SC802"."""
    return InvalidInput([Problem(str(path), 0, 0, code, message, hint)])


@contextmanager
def unreadable_log_as_invalid_input(path: Path) -> Iterator[None]:
    """Context manager that converts exceptions of reading a log to InvalidInput with file and reason."""
    try:
        yield
    except OSError as error:
        raise invalid_log(path, "SC800", f"cannot read the log: {error.strerror or error}") from error
    except NotSimscenLog as error:
        raise invalid_log(path, "SC801", f"not a log of simscen: {error}") from error
    except _READ_ERRORS as error:
        raise invalid_log(path, "SC802", f"the log is damaged: {error or type(error).__name__}") from error


@dataclass(frozen=True, eq=False)
class Log:
    """Contents of a log.

    Attributes:
        header: Description of the run.
        trace: Signals and events of the robot, or of the first one of several robots.
        result: Content of result.json; "" if the run was not judged.
        complete: False if the run was aborted. The trace then ends with the last message.
        robots: Contents of each robot by name if there are several robots; empty for a single robot.
        sensors: Messages that are not part of the trace; empty unless requested by `with_sensors`.
        coverage: Evidence that the log lacks because messages were removed after the recording.
        stack: Facts about the external stack, as in stack.json; empty for the reference stack and an aborted run.
    """

    header: LogHeader
    trace: Trace
    result: str
    complete: bool
    robots: Mapping[str, "Log"] = field(default_factory=dict)
    sensors: SensorMessages = field(default_factory=SensorMessages)
    coverage: LogCoverage = COMPLETE_COVERAGE
    stack: Mapping[str, str] = field(default_factory=dict)

    @property
    def traces(self) -> list[Trace]:
        """Traces of all robots."""
        return [log.trace for log in self.robots.values()] or [self.trace]


def read_run(path: Path, with_sensors: bool = False) -> Log:
    """Read a log with `read_log`. In addition, raises InvalidInput if the log has no ground truth."""
    log = read_log(path, with_sensors=with_sensors)
    if not len(log.trace.truth):
        removed = f"the messages of {topics.TRUTH.name} were removed"
        reason = removed if log.complete else "its run was aborted before the first step"
        raise invalid_log(path, "SC803", f"the log has no ground truth: {reason}")
    return log


def read_log(path: "str | Path", partial: bool | None = None, with_sensors: bool = False) -> Log:
    """Read a log that a Recorder wrote.

    Raises InvalidInput if the file cannot be read, is not a log of simscen, is damaged, or is truncated.

    partial:       whether to accept a truncated log; None to accept it only if the name ends with `.partial.mcap`
    with_sensors:  whether to read the messages that are not part of the trace
    """
    path = Path(path)
    accept_truncated = path.name.endswith(PARTIAL_SUFFIX) if partial is None else partial
    contents = LogContents(with_sensors)
    with unreadable_log_as_invalid_input(path):
        with open_log(path) as stream:
            complete = _read(stream, contents)
        header = contents.header()
        if not complete and not accept_truncated:
            hint = "to read it nevertheless, rename it to *.partial.mcap"
            raise invalid_log(path, "SC803", "the log is truncated: its run was aborted", hint)
        robots = {
            name: Log(header.robots[name], trace, "", complete, {}, robot.sensors, robot.coverage(), robot.stack)
            for (name, trace), robot in zip(contents.traces().items(), contents.robots.values(), strict=True)
        }
        trace, result = contents.trace(), contents.result()
        return Log(header, trace, result, complete, robots, contents.sensors, contents.coverage(), contents.stack)


def _read(stream: IO[bytes], contents: LogContents) -> bool:
    """Add all records to `contents`. Return whether the log is complete."""
    if not is_mcap(stream):
        raise NotSimscenLog("it is not an MCAP file")
    records = RecordReader(stream)
    for record in records:
        contents.add(record)
    if stream.read(1):
        raise ValueError("data follows its end; a file of several logs cannot be judged")
    return contents.end is not None and not records.is_truncated
