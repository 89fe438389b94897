"""Why a log of others cannot be used at all."""

import re
from collections.abc import Container, Iterator
from pathlib import Path
from typing import NamedTuple

from mcap import records

from simscen.record.log_file import RecordReader, open_log
from simscen.record.mcap_writer import MAGIC


class UnusableLog(ValueError):
    """A log that cannot be judged; the message says why, `hint` what helps."""

    def __init__(self, message: str, hint: str = "") -> None:
        self.hint = hint
        super().__init__(message)


class RawMessage(NamedTuple):
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

    def __iter__(self) -> Iterator[RawMessage]:
        """Read the file once."""
        with open_log(self._path) as stream:
            if stream.read(len(MAGIC)) != MAGIC:
                raise UnusableLog("it is not an MCAP file")
            stream.seek(0)
            whole = RecordReader(stream)
            yield from self._messages(whole)
            self.complete = not whole.cut

    def _messages(self, whole: RecordReader) -> Iterator[RawMessage]:
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
                    yield RawMessage(channel.topic, kind, channel.message_encoding, record.log_time, record.data)
                case _:
                    pass


def is_simscen_log(path: Path) -> bool:
    """Whether simscen wrote this file, which it says before the first message; True where nothing can be told."""
    try:
        with open_log(path) as stream:
            for record in RecordReader(stream):
                if isinstance(record, records.Metadata) and record.name == "simscen":
                    return True
                if isinstance(record, records.Message):
                    return False
    except Exception:  # whoever reads all of it says what is wrong
        return True
    return False


def _refuse_ros1(kind: str) -> None:
    if kind == "ros1":
        raise UnusableLog("it is a log of ROS 1", "convert it, e.g. with `rosbags-convert`, whose logs are of ROS 2")


INSTALL_ROSBAGS = "pip install 'rosbags>=0.10,<1'"


class BagMessages:
    """Gives a folder's messages, file after file; then `complete` says whether all are there that it speaks of."""

    def __init__(self, folder: Path, wanted: Container[str]) -> None:
        self._folder, self._wanted = folder, wanted
        self.complete = False
        self.topics: dict[str, str] = {}

    def __iter__(self) -> Iterator[RawMessage]:
        """Read the folder once. Raises Unusable."""
        files = sorted(self._folder.glob("*.mcap"), key=_file_number)
        return self._own(files) if files and not self._is_compressed() else self._through_rosbags()

    def _is_compressed(self) -> bool:
        """Whether rosbag2 compressed each message or file on top of what MCAP does."""
        metadata = self._folder / "metadata.yaml"
        text = metadata.read_text(encoding="utf-8", errors="replace") if metadata.is_file() else ""
        return re.search(r"compression_mode:\s*['\"]?(message|file)", text, re.IGNORECASE) is not None

    def _own(self, files: list[Path]) -> Iterator[RawMessage]:
        whole = []
        for file in files:
            messages = McapMessages(file)
            yield from messages
            self.topics.update(messages.topics)
            whole.append(messages.complete)
        self.complete = all(whole)

    def _through_rosbags(self) -> Iterator[RawMessage]:
        try:
            from rosbags.rosbag2 import Reader
        except ImportError as error:
            raise UnusableLog("only the rosbags package reads SQLite and compressed bags", INSTALL_ROSBAGS) from error
        count = 0
        try:
            with Reader(self._folder) as reader:
                self.topics = {one.topic: one.msgtype for one in reader.connections}
                chosen = [one for one in reader.connections if one.topic in self._wanted]
                for connection, time, data in reader.messages(chosen) if chosen else ():
                    count += 1
                    yield RawMessage(connection.topic, connection.msgtype, "cdr", time, bytes(data))
                self.complete = count == sum(one.msgcount for one in chosen)
        except (UnusableLog, OSError):
            raise
        except Exception as error:  # rosbags lets what SQLite, YAML and zstd raise fall through
            told = f"rosbags cannot read it: {error or type(error).__name__}"
            raise UnusableLog(told, "try `ros2 bag reindex`") from error


def open_messages(path: Path, wanted: Container[str]) -> McapMessages | BagMessages:
    """The messages of an MCAP file or of a rosbag2 folder, those on the topics `wanted` at least. Raises Unusable."""
    if path.is_dir():
        return BagMessages(path, wanted)
    if path.suffix == ".bag":
        raise UnusableLog("it is a bag of ROS 1", "convert it, e.g. with `rosbags-convert`, whose bags are of ROS 2")
    if path.suffix == ".db3":
        raise UnusableLog("a rosbag2 is a folder with a metadata.yaml", "name the folder; see `ros2 bag reindex`")
    return McapMessages(path)


def _file_number(file: Path) -> tuple[int, str]:
    """rosbag2 numbers its files: name_0, name_1, …, name_10."""
    number = re.search(r"_(\d+)$", file.stem)
    return (int(number[1]) if number else -1, file.name)
