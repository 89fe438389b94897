"""Recovery of the log of an aborted run: adds the MCAP index, which other tools need."""

import os
from pathlib import Path
from typing import IO

from mcap import records

from simscen.record.log_contents import NotSimscenLog
from simscen.record.log_file import write_error
from simscen.record.log_header import RUN_RECORD
from simscen.record.log_reader import unreadable_log_as_invalid_input
from simscen.record.mcap_reader import RecordReader, is_mcap, open_log
from simscen.record.mcap_writer import MAGIC, Channel, McapWriter
from simscen.record.topics import MessageType


def recover(path: Path) -> bool:
    """Rewrite a log with an index, and return True. Leave a log that has an index unchanged, and return False.

    Raises InvalidInput if the file cannot be read or is not a log of simscen. Raises RunError of kind "output" if the
    new file cannot be written.
    """
    part_path = path.with_name(f".{path.name}.{os.getpid()}.part")
    with unreadable_log_as_invalid_input(path):
        try:
            with open_log(path) as stream:
                if _ends_with_magic(stream):
                    return False
                with part_path.open("wb") as file:
                    _copy(stream, file)
            part_path.replace(path)
        except OSError as error:
            if part_path.exists():
                raise write_error(part_path, error) from error
            raise
        finally:
            part_path.unlink(missing_ok=True)
    return True


def _ends_with_magic(stream: IO[bytes]) -> bool:
    """Return whether the file ends with the MCAP magic bytes. Raises NotSimscenLog if it is not an MCAP file."""
    if not is_mcap(stream):
        raise NotSimscenLog("it is not an MCAP file")
    size = stream.seek(0, os.SEEK_END)
    stream.seek(max(len(MAGIC), size - len(MAGIC)))
    is_complete = stream.read() == MAGIC
    stream.seek(0)
    return is_complete


def _copy(stream: IO[bytes], file: IO[bytes]) -> None:
    """Write all complete records of a log of simscen to `file`, and an index after them."""
    writer: McapWriter | None = None
    is_simscen_log = False
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
                channels[record.id] = writer.add_channel(record.topic, types[record.schema_id], record.metadata)
            case records.Message():
                if not is_simscen_log:
                    raise NotSimscenLog("another program recorded it; recover it with `mcap recover`")
                channels[record.channel_id].write(record.log_time, record.data)
            case records.Attachment():
                writer.add_attachment(record.name, record.media_type, record.data)
            case records.Metadata():
                writer.add_metadata(record.name, record.metadata)
                is_simscen_log |= record.name == RUN_RECORD
            case _:
                pass  # the writer creates new indexes
    if writer is None:
        raise NotSimscenLog("it has no header")
    writer.finish()
