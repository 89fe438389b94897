"""The messages of an MCAP file that anybody wrote: chunked or not, compressed, without an index, cut off."""

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from mcap import records

from simscen.record.foreign.unusable import Unusable
from simscen.record.openlog import WholeRecords, open_log
from simscen.record.writer import MAGIC


class Raw(NamedTuple):
    """A message as it stands in the log: `time` is when it was logged, in nanoseconds."""

    topic: str
    type: str
    encoding: str
    time: int
    data: bytes


class McapMessages:
    """Gives a file's messages in the order of the file; then `complete` says whether it came to its end.

    Raises Unusable for a log of ROS 1, and what the mcap library raises on damage.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self.complete = False
        self.topics: dict[str, str] = {}

    def __iter__(self) -> Iterator[Raw]:
        """Read the file once."""
        with open_log(self._path) as stream:
            if stream.read(len(MAGIC)) != MAGIC:
                raise Unusable("it is not an MCAP file")
            stream.seek(0)
            whole = WholeRecords(stream)
            yield from self._messages(whole)
            self.complete = not whole.cut

    def _messages(self, whole: WholeRecords) -> Iterator[Raw]:
        types: dict[int, str] = {}
        channels: dict[int, records.Channel] = {}
        for record in whole:
            match record:
                case records.Header():
                    _refuse_ros1(record.profile)
                case records.Schema():
                    types[record.id] = record.name
                case records.Channel():
                    _refuse_ros1(record.message_encoding)
                    channels[record.id] = record
                    self.topics[record.topic] = types.get(record.schema_id, "")
                case records.Message():
                    channel = channels[record.channel_id]
                    kind = types.get(channel.schema_id, "")
                    yield Raw(channel.topic, kind, channel.message_encoding, record.log_time, record.data)
                case _:
                    pass


def is_own(path: Path) -> bool:
    """Whether simscen wrote this file, which it says before the first message; True where nothing can be told."""
    try:
        with open_log(path) as stream:
            for record in WholeRecords(stream):
                if isinstance(record, records.Metadata) and record.name == "simscen":
                    return True
                if isinstance(record, records.Message):
                    return False
    except Exception:  # whoever reads all of it says what is wrong
        return True
    return False


def _refuse_ros1(kind: str) -> None:
    if kind == "ros1":
        raise Unusable("it is a log of ROS 1", "convert it, e.g. with `rosbags-convert`, whose logs are of ROS 2")
