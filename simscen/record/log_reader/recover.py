"""Makes the log of a run that broke off whole for other readers: the index at its end is what they begin with."""

import os
from pathlib import Path
from typing import IO

from mcap import records

from simscen.record.log_file import RecordReader, open_log, write_error
from simscen.record.log_reader.contents import NotSimscenLog
from simscen.record.log_reader.read import LOG_READ_ERRORS, invalid_log
from simscen.record.mcap_writer import MAGIC, Channel, McapWriter, MessageType


def recover(path: Path) -> bool:
    """Write the log anew with all that is whole in it, and an index; False when it has one already.

    It stays the log of a run that broke off, and keeps its name. Raises InvalidInput when the file cannot be read or is
    no MCAP, RunError of kind "output" when there is no room for it.
    """
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        with open_log(path) as stream:
            if _is_whole(stream):
                return False
            with part.open("wb") as file:
                _copy(stream, file)
        part.replace(path)
    except OSError as error:
        if part.exists():
            raise write_error(part, error) from error
        raise invalid_log(path, "SC800", f"cannot read the log: {error.strerror}") from error
    except NotSimscenLog as error:
        raise invalid_log(path, "SC801", f"not a log of simscen: {error}") from error
    except LOG_READ_ERRORS as error:
        raise invalid_log(path, "SC802", f"the log is damaged: {error or type(error).__name__}") from error
    finally:
        part.unlink(missing_ok=True)
    return True


def _is_whole(stream: IO[bytes]) -> bool:
    """Whether it ends as an MCAP file does. Raises Foreign when it does not begin as one."""
    if stream.read(len(MAGIC)) != MAGIC:
        raise NotSimscenLog("it is not an MCAP file")
    size = stream.seek(0, os.SEEK_END)
    stream.seek(max(len(MAGIC), size - len(MAGIC)))
    ends = stream.read() == MAGIC
    stream.seek(0)
    return ends


def _copy(stream: IO[bytes], file: IO[bytes]) -> None:
    """Chunks come out as they went in, so that only the end of the file changes."""
    writer: McapWriter | None = None
    kinds: dict[int, MessageType] = {}
    channels: dict[int, Channel] = {}
    for record in RecordReader(stream):
        if isinstance(record, records.Header):
            writer = McapWriter(file, record.profile, record.library)
            continue
        if writer is None:
            raise NotSimscenLog("it has no header")
        match record:
            case records.Schema():
                kinds[record.id] = MessageType(record.name, record.data.decode(), "")
            case records.Channel():
                channels[record.id] = writer.channel(record.topic, kinds[record.schema_id], record.metadata)
            case records.Message():
                channels[record.channel_id].write(record.log_time, record.data)
            case records.Attachment():
                writer.attach(record.name, record.media_type, record.data)
            case records.Metadata():
                writer.note(record.name, record.metadata)
            case _:
                pass  # indices: they are made anew
    if writer is None:
        raise NotSimscenLog("it has no header")
    writer.finish()
