"""Reading of logs that simscen recorded, and recovery of the index of a log whose run was aborted."""

import os
import struct
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO

from mcap import records
from mcap.exceptions import McapError
from zstandard import ZstdError

from simscen.core.errors import InvalidInput, Problem
from simscen.core.records.trace import Trace
from simscen.core.records.verdict import COMPLETE_COVERAGE, LogCoverage
from simscen.record.log_contents import LogContents, NotSimscenLog
from simscen.record.log_file import PARTIAL_SUFFIX, RecordReader, open_log, write_error
from simscen.record.log_header import LogHeader
from simscen.record.mcap_writer import MAGIC, Channel, McapWriter, MessageType
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
"""Exceptions that the libraries and the decoders raise on damaged files."""


def invalid_log(path: Path, code: str, message: str, hint: str = "") -> InvalidInput:
    """Return the exception for a problem with a log. `code` is the error code, such as "SC802"."""
    return InvalidInput([Problem(str(path), 0, 0, code, message, hint)])


@contextmanager
def unreadable_log_as_invalid_input(path: Path) -> Iterator[None]:
    """Context manager that raises InvalidInput, with file and reason, for the exceptions of reading a log."""
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

    With several robots, `robots` has the log of each robot by name, and `header` and `trace` are those of the first.

    Attributes:
        header: Description of the run.
        trace: Signals and events of the run.
        result: Result of the run (JSON), or "" if there is none.
        complete: False if the run was aborted; the trace then ends with the last message.
        sensors: Messages that are not part of the trace. Empty unless requested.
        coverage: Evidence that is missing because the log has fewer messages than were recorded.
        stack: Facts about the external stack, as in stack.json; `about` is JSON. Empty for the reference stack, and if
            the run was aborted.
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
        """Trace of each robot."""
        return [log.trace for log in self.robots.values()] or [self.trace]


def read_run(path: Path, with_sensors: bool = False) -> Log:
    """Read a log to judge or draw its run. Raises InvalidInput as `read_log` does, and if there is no ground truth."""
    log = read_log(path, with_sensors=with_sensors)
    if not len(log.trace.truth):
        raise invalid_log(path, "SC803", "the log has no ground truth: its run was aborted before the first step")
    return log


def read_log(path: "str | Path", partial: bool | None = None, with_sensors: bool = False) -> Log:
    """Read a log that a Recorder wrote.

    Its trace equals the one that a TraceBuilder builds from the same moments, to the last bit. With `partial`, accept a
    truncated log; by default, files named `*.partial.mcap` are accepted. With `with_sensors`, also keep the messages
    that are not part of the trace. Raises InvalidInput if the file cannot be read, is not a log of simscen, is damaged,
    or is truncated.
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
        own = contents.sensors, contents.coverage(), contents.stack
        return Log(header, trace, result, complete, robots, *own)


def _read(stream: IO[bytes], contents: LogContents) -> bool:
    """Add all records to `contents`. Return False if they stop before the end of the run."""
    if stream.read(len(MAGIC)) != MAGIC:
        raise NotSimscenLog("it is not an MCAP file")
    stream.seek(0)
    records = RecordReader(stream)
    for record in records:
        contents.add(record)
    if stream.read(1):
        raise ValueError("data follows its end; a file of several logs cannot be judged")
    return contents.end is not None and not records.is_truncated


def recover(path: Path) -> bool:
    """Rewrite the log of an aborted run with an index, which other tools need.

    Returns whether the log was rewritten; False if it already has an index.

    The log keeps its name, and remains the log of an aborted run. Raises InvalidInput if the file cannot be read or is
    not MCAP, RunError of kind "output" if the new file cannot be written.
    """
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    with unreadable_log_as_invalid_input(path):
        try:
            with open_log(path) as stream:
                if _ends_with_magic(stream):
                    return False
                with part.open("wb") as file:
                    _copy(stream, file)
            part.replace(path)
        except OSError as error:
            if part.exists():
                raise write_error(part, error) from error
            raise
        finally:
            part.unlink(missing_ok=True)
    return True


def _ends_with_magic(stream: IO[bytes]) -> bool:
    """Return whether the file ends like a complete MCAP file. Raises NotSimscenLog if it does not start like one."""
    if stream.read(len(MAGIC)) != MAGIC:
        raise NotSimscenLog("it is not an MCAP file")
    size = stream.seek(0, os.SEEK_END)
    stream.seek(max(len(MAGIC), size - len(MAGIC)))
    is_complete = stream.read() == MAGIC
    stream.seek(0)
    return is_complete


def _copy(stream: IO[bytes], file: IO[bytes]) -> None:
    """Copy all complete records. Chunks stay the same, so that only the end of the file changes."""
    writer: McapWriter | None = None
    types: dict[int, MessageType] = {}
    channels: dict[int, Channel] = {}
    for record in RecordReader(stream):
        if isinstance(record, records.Header):
            writer = McapWriter(file, record.profile, record.library)
            continue
        if writer is None:
            raise NotSimscenLog("it has no header")
        match record:
            case records.Schema():
                types[record.id] = MessageType(record.name, record.data.decode(), "")
            case records.Channel():
                channels[record.id] = writer.channel(record.topic, types[record.schema_id], record.metadata)
            case records.Message():
                channels[record.channel_id].write(record.log_time, record.data)
            case records.Attachment():
                writer.add_attachment(record.name, record.media_type, record.data)
            case records.Metadata():
                writer.add_metadata(record.name, record.metadata)
            case _:
                pass  # indexes are written again
    if writer is None:
        raise NotSimscenLog("it has no header")
    writer.finish()
