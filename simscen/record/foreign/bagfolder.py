"""The messages of a rosbag2 folder. Its MCAP files we read ourselves; SQLite and compressed files rosbags does."""

import re
from collections.abc import Container, Iterator
from pathlib import Path

from simscen.record.foreign.mcapfile import McapMessages, Raw
from simscen.record.foreign.unusable import Unusable

INSTALL = "pip install 'rosbags>=0.10,<1'"


class BagMessages:
    """Gives a folder's messages, file after file; then `complete` says whether all are there that it speaks of."""

    def __init__(self, folder: Path, wanted: Container[str]) -> None:
        self._folder, self._wanted = folder, wanted
        self.complete = False
        self.topics: dict[str, str] = {}

    def __iter__(self) -> Iterator[Raw]:
        """Read the folder once. Raises Unusable."""
        files = sorted(self._folder.glob("*.mcap"), key=_numbered)
        return self._own(files) if files and not self._is_compressed() else self._through_rosbags()

    def _is_compressed(self) -> bool:
        """Whether rosbag2 compressed each message or file on top of what MCAP does."""
        metadata = self._folder / "metadata.yaml"
        text = metadata.read_text(encoding="utf-8", errors="replace") if metadata.is_file() else ""
        return re.search(r"compression_mode:\s*['\"]?(message|file)", text, re.IGNORECASE) is not None

    def _own(self, files: list[Path]) -> Iterator[Raw]:
        whole = []
        for file in files:
            messages = McapMessages(file)
            yield from messages
            self.topics.update(messages.topics)
            whole.append(messages.complete)
        self.complete = all(whole)

    def _through_rosbags(self) -> Iterator[Raw]:
        try:
            from rosbags.rosbag2 import Reader
        except ImportError as error:
            raise Unusable("only the rosbags package reads SQLite and compressed bags", INSTALL) from error
        count = 0
        try:
            with Reader(self._folder) as reader:
                self.topics = {one.topic: one.msgtype for one in reader.connections}
                chosen = [one for one in reader.connections if one.topic in self._wanted]
                for connection, time, data in reader.messages(chosen) if chosen else ():
                    count += 1
                    yield Raw(connection.topic, connection.msgtype, "cdr", time, bytes(data))
                self.complete = count == sum(one.msgcount for one in chosen)
        except (Unusable, OSError):
            raise
        except Exception as error:  # rosbags lets what SQLite, YAML and zstd raise fall through
            told = f"rosbags cannot read it: {error or type(error).__name__}"
            raise Unusable(told, "try `ros2 bag reindex`") from error


def messages_of(path: Path, wanted: Container[str]) -> McapMessages | BagMessages:
    """The messages of an MCAP file or of a rosbag2 folder, those on the topics `wanted` at least. Raises Unusable."""
    if path.is_dir():
        return BagMessages(path, wanted)
    if path.suffix == ".bag":
        raise Unusable("it is a bag of ROS 1", "convert it, e.g. with `rosbags-convert`, whose bags are of ROS 2")
    if path.suffix == ".db3":
        raise Unusable("a rosbag2 is a folder with a metadata.yaml", "name the folder; see `ros2 bag reindex`")
    return McapMessages(path)


def _numbered(file: Path) -> tuple[int, str]:
    """rosbag2 numbers its files: name_0, name_1, …, name_10."""
    number = re.search(r"_(\d+)$", file.stem)
    return (int(number[1]) if number else -1, file.name)
