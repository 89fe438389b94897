"""Reads a log back into the Trace of its run, so that it can be judged without a simulator."""

import struct
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO

from mcap.exceptions import McapError
from zstandard import ZstdError

from simscen.core.errors import InvalidInput, Problem
from simscen.core.records.trace import Trace
from simscen.core.records.verdict import COMPLETE_COVERAGE, LogCoverage
from simscen.record.log_file import PARTIAL_SUFFIX, RecordReader, open_log
from simscen.record.log_header import LogHeader
from simscen.record.log_reader.contents import LogContents, NotSimscenLog
from simscen.record.log_reader.sensor_messages import SensorMessages
from simscen.record.mcap_writer import MAGIC

# What the libraries and our own readers raise on bytes that no Recorder wrote.
LOG_READ_ERRORS = (
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


@dataclass(frozen=True, eq=False)
class Log:
    """A log that was read: how the run was ordered, what happened, and its result (JSON; "" while there is none).

    `complete` is False for the log of a run that broke off; its trace then ends with the last message. `robots` has
    what the log says of each of several robots, by name; `about` and `trace` are then those of the first. `seen` is
    what no trace holds; empty unless it was asked for.
    """

    about: LogHeader
    trace: Trace
    result: str
    complete: bool
    robots: Mapping[str, "Log"] = field(default_factory=dict)
    seen: SensorMessages = field(default_factory=SensorMessages)
    coverage: LogCoverage = COMPLETE_COVERAGE
    """Evidence that the log lacks, because it holds fewer messages than were recorded."""

    @property
    def traces(self) -> list[Trace]:
        """What happened to each robot."""
        return [log.trace for log in self.robots.values()] or [self.trace]


def read_run(path: Path, looks: bool = False) -> Log:
    """Read a log to judge or draw its run. Raises InvalidInput as `read_log` does, and where there is no truth."""
    log = read_log(path, looks=looks)
    if not len(log.trace.truth):
        raise invalid_log(path, "SC803", "the log holds no truth: its run broke off before it began")
    return log


def read_log(path: "str | Path", partial: bool | None = None, looks: bool = False) -> Log:
    """Read a log that a Recorder wrote.

    Its trace is the one that a TraceBuilder makes of the same moments, equal to the last bit. With `partial`, a log
    that ends too early is read as far as it goes; by default that is so for files named `*.partial.mcap`. With `looks`,
    what no trace holds is kept in `seen`. Raises InvalidInput when the file cannot be read, is no MCAP, is none of
    simscen's, is damaged, or ends too early.
    """
    path = Path(path)
    forgiving = path.name.endswith(PARTIAL_SUFFIX) if partial is None else partial
    contents = LogContents(looks)
    try:
        with open_log(path) as stream:
            whole = _read(stream, contents)
        about = contents.header()
        if not whole and not forgiving:
            hint = "to read what there is, name it *.partial.mcap"
            raise invalid_log(path, "SC803", "the log ends too early: its run broke off", hint)
        robots = {
            name: Log(about.robots[name], trace, "", whole, {}, one.seen(), one.coverage())
            for (name, trace), one in zip(contents.traces().items(), contents.robots.values(), strict=True)
        }
        return Log(about, contents.trace(), contents.result(), whole, robots, contents.seen(), contents.coverage())
    except OSError as error:
        raise invalid_log(path, "SC800", f"cannot read the log: {error.strerror}") from error
    except NotSimscenLog as error:
        raise invalid_log(path, "SC801", f"not a log of simscen: {error}") from error
    except LOG_READ_ERRORS as error:
        raise invalid_log(path, "SC802", f"the log is damaged: {error or type(error).__name__}") from error


def _read(stream: IO[bytes], contents: LogContents) -> bool:
    """Put all records into `contents`; False when they stop before the end of the run."""
    if stream.read(len(MAGIC)) != MAGIC:
        raise NotSimscenLog("it is not an MCAP file")
    stream.seek(0)
    records = RecordReader(stream)
    for record in records:
        contents.take(record)
    return contents.end is not None and not records.cut


def invalid_log(path: Path, code: str, message: str, hint: str = "") -> InvalidInput:
    """A problem with a log."""
    return InvalidInput([Problem(str(path), 0, 0, code, message, hint)])
