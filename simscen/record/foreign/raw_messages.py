"""Iteration over the serialized messages of MCAP files and rosbag2 folders, and recognition of simscen's logs."""

import json
import re
from collections.abc import Callable, Container, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

from mcap import records

from simscen.record.foreign.bag_metadata import read_bag_metadata
from simscen.record.log_header import ROBOTS_KEY, RUN_RECORD
from simscen.record.log_reader import invalid_log, unreadable_log_as_invalid_input
from simscen.record.mcap_reader import RecordReader, is_mcap, open_log
from simscen.record.messages.decode import InvalidOrientation, MessageReader, decode_checked

Decoders = Mapping[str, Callable[[MessageReader], Any]]
"""Functions that decode a message, by ROS message type."""


class UnusableLog(ValueError):
    """The log cannot be used. The message states the reason. `hint` states the solution; "" if it is unknown."""

    def __init__(self, message: str, hint: str = "") -> None:
        self.hint = hint
        super().__init__(message)


class InvalidPose(UnusableLog):
    """The orientation in a message is not a rotation. Readers ignore such messages.

    For example, a tracking system that has lost the robot may publish a quaternion of zeros.
    """


def invalid_pose_notes(counts: Mapping[str, int]) -> list[str]:
    """Return notes on messages that are ignored because of InvalidPose. `counts` are their numbers by topic."""
    return [f"{topic}: messages with an invalid orientation are ignored ({count})" for topic, count in counts.items()]


@contextmanager
def unusable_log_as_invalid_input(path: Path) -> Iterator[None]:
    """Context manager that converts exceptions for unreadable and unusable logs to InvalidInput with the path."""
    with unreadable_log_as_invalid_input(path):
        try:
            yield
        except UnusableLog as error:
            raise invalid_log(path, "SC804", str(error), error.hint) from error


class RawMessage(NamedTuple):
    """Serialized message. `encoding` is "cdr" for ROS 2. `time` is the time of logging in ns."""

    topic: str
    type: str
    encoding: str
    time: int
    data: bytes

    def mismatch(self, decoders: Decoders) -> str:
        """Return why no decoder suits the encoding and type of the message; "" if a decoder does."""
        if self.encoding != "cdr":
            return f"{self.topic} is encoded as {self.encoding or 'something unknown'}, not as CDR"
        return type_mismatch(self.topic, self.type, decoders)

    def decode(self, decoders: Decoders, label: str = "a message", frame_prefix: str = "") -> Any:
        """Return the decoded message. Raises InvalidPose for an invalid orientation, and UnusableLog for other errors.

        `label` names the message in the text of the exception. `frame_prefix` is removed from the names of frames.
        """
        if mismatch := self.mismatch(decoders):
            raise UnusableLog(mismatch)
        try:
            return decode_checked(decoders[self.type], self.data, frame_prefix)
        except InvalidOrientation as error:
            raise InvalidPose(f"{label} of {self.topic}: {error}") from error
        except (ValueError, OverflowError) as error:
            raise UnusableLog(f"{label} of {self.topic} cannot be read as {self.type}: {error}") from error


def type_mismatch(topic: str, message_type: str, decoders: Decoders) -> str:
    """Return why no decoder suits the message type of a topic; "" if a decoder does."""
    if message_type in decoders:
        return ""
    return f"{topic} is a {message_type or 'type without a name'}, expected {' or '.join(decoders)}"


class McapMessages:
    """Iterable of the messages of an MCAP file.

    The iteration raises UnusableLog for ROS 1, for files that are not MCAP, and for several concatenated files. It
    raises exceptions of the mcap library for damaged files. The attributes are valid after the iteration.

    Attributes:
        is_complete: False if the file is truncated.
        count: Number of messages.
        topics: Message types by topic, which always starts with a slash.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        self.is_complete = False
        self.count = 0
        self.topics: dict[str, str] = {}

    def __iter__(self) -> Iterator[RawMessage]:
        """Yield the messages in the order of the file."""
        with open_log(self._path) as stream:
            if not is_mcap(stream):
                raise UnusableLog("it is not an MCAP file")
            reader = RecordReader(stream)
            yield from self._messages(reader)
            if stream.read(1):
                raise UnusableLog("data follows its end", "if it is a file of several logs, split it")
            self.is_complete = not reader.is_truncated

    def _messages(self, reader: RecordReader) -> Iterator[RawMessage]:
        types: dict[int, str] = {}
        channels: dict[int, records.Channel] = {}
        for record in reader:
            match record:
                case records.Header():
                    _reject_ros1(record.profile)
                case records.Schema():
                    types[record.id] = record.name
                case records.Channel():
                    _reject_ros1(record.message_encoding)
                    channels[record.id] = record
                    self.topics[_absolute(record.topic)] = types.get(record.schema_id, "")
                case records.Message():
                    channel = channels[record.channel_id]
                    message_type, encoding = types.get(channel.schema_id, ""), channel.message_encoding
                    self.count += 1
                    yield RawMessage(_absolute(channel.topic), message_type, encoding, record.log_time, record.data)
                case _:
                    pass


def _absolute(topic: str) -> str:
    """Return a topic with one leading slash. Recorders other than `ros2 bag record` may omit the slash."""
    return f"/{topic.lstrip('/')}"


def is_simscen_log(path: Path) -> bool:
    """Return whether simscen recorded this file.

    Return True if the file cannot be read. The reader of simscen's logs then raises the exception with the reason.
    """
    try:
        return _run_metadata(path) is not None
    except Exception:
        return True


def recorded_robots(path: Path) -> tuple[str, ...]:
    """Return the names of the robots in a log of simscen with several robots; () for other logs."""
    try:
        return tuple(json.loads((_run_metadata(path) or {}).get(ROBOTS_KEY, "[]")))
    except Exception:
        return ()


def _run_metadata(path: Path) -> dict[str, str] | None:
    """Return the metadata record of simscen before the first message; None if it is missing."""
    with open_log(path) as stream:
        for record in RecordReader(stream):
            if isinstance(record, records.Metadata) and record.name == RUN_RECORD:
                return dict(record.metadata)
            if isinstance(record, records.Message):
                break
    return None


def _reject_ros1(profile: str) -> None:
    """Raise UnusableLog if `profile`, the profile of a file or the encoding of a channel, is that of ROS 1."""
    if profile == "ros1":
        raise UnusableLog("it is a log of ROS 1", "convert it, e.g. with `rosbags-convert`, whose logs are of ROS 2")


INSTALL_ROSBAGS = "pip install 'rosbags>=0.10,<1'"
"""Hint for bags that need the optional package rosbags."""


class BagMessages:
    """Iterable of the messages of a rosbag2 folder.

    SQLite and compressed bags need the optional package rosbags. From these bags, only messages on `selected_topics`
    are read. The attributes are valid after the iteration.

    Attributes:
        is_complete: False if messages are missing.
        topics: Message types by topic, which always starts with a slash.
    """

    def __init__(self, folder: Path, selected_topics: Container[str]) -> None:
        self._folder, self._selected_topics = folder, selected_topics
        self.is_complete = False
        self.topics: dict[str, str] = {}

    def __iter__(self) -> Iterator[RawMessage]:
        """Yield the messages of all files. Raises UnusableLog."""
        metadata = read_bag_metadata(self._folder)
        if metadata is None:
            files = sorted(self._folder.glob("*.mcap"), key=_file_number)
            return self._read_mcap(files, 0) if files else self._read_with_rosbags()
        if metadata.storage != "mcap" or metadata.is_compressed:
            return self._read_with_rosbags()
        return self._read_mcap([self._folder / name for name in metadata.files], metadata.message_count)

    def _read_mcap(self, files: Sequence[Path], expected_count: int) -> Iterator[RawMessage]:
        """Yield the messages of MCAP files, which should have at least `expected_count` messages in total."""
        if missing := [file.name for file in files if not file.exists()]:
            raise UnusableLog(f"metadata.yaml lists {missing[0]}, which is missing", "add the file to the folder")
        are_complete, count = True, 0
        for file in files:
            messages = McapMessages(file)
            yield from messages
            self.topics.update(messages.topics)
            are_complete &= messages.is_complete
            count += messages.count
        self.is_complete = are_complete and count >= expected_count

    def _read_with_rosbags(self) -> Iterator[RawMessage]:
        try:
            from rosbags.rosbag2 import Reader
        except ImportError as error:
            raise UnusableLog("SQLite and compressed bags need the package rosbags", INSTALL_ROSBAGS) from error
        count = 0
        try:
            with Reader(self._folder) as reader:
                names = {connection.topic: _absolute(connection.topic) for connection in reader.connections}
                self.topics = {names[connection.topic]: connection.msgtype for connection in reader.connections}
                selected = [c for c in reader.connections if names[c.topic] in self._selected_topics]
                for connection, time, data in reader.messages(selected) if selected else ():
                    count += 1
                    yield RawMessage(names[connection.topic], connection.msgtype, "cdr", time, bytes(data))
                self.is_complete = count == sum(connection.msgcount for connection in selected)
        except (UnusableLog, OSError):
            raise
        except Exception as error:  # rosbags does not catch exceptions of SQLite, YAML and zstd
            text = f"rosbags cannot read it: {error or type(error).__name__}"
            raise UnusableLog(text, "try `ros2 bag reindex`") from error


def open_messages(path: Path, topics: Container[str]) -> McapMessages | BagMessages:
    """Return an iterable of the messages of an MCAP file or a rosbag2 folder.

    The iterable contains all messages on `topics`, and may contain messages on other topics. Raises UnusableLog for
    .bag and .db3 files.
    """
    if path.is_dir():
        return BagMessages(path, topics)
    if path.suffix == ".bag":
        raise UnusableLog("it is a bag of ROS 1", "convert it, e.g. with `rosbags-convert`, whose bags are of ROS 2")
    if path.suffix == ".db3":
        raise UnusableLog("a rosbag2 is a folder with a metadata.yaml", "name the folder; see `ros2 bag reindex`")
    return McapMessages(path)


def _file_number(file: Path) -> tuple[int, str]:
    """Return the sort key of a file of a bag, for the order name_0, name_1, …, name_10."""
    number = re.search(r"_(\d+)$", file.stem)
    return (int(number[1]) if number else -1, file.name)
