"""Content of the metadata.yaml of a rosbag2 folder."""

from dataclasses import dataclass
from pathlib import Path, PurePosixPath

import yaml


@dataclass(frozen=True)
class BagMetadata:
    """Entries of metadata.yaml that simscen uses.

    storage:        storage plug-in: "mcap" or "sqlite3"
    is_compressed:  whether rosbag2 has compressed the messages or files, in addition to the compression of MCAP
    files:          names of the files in the folder, in the order of recording
    message_count:  number of messages in all files
    """

    storage: str
    is_compressed: bool
    files: tuple[str, ...]
    message_count: int


def read_bag_metadata(folder: Path) -> BagMetadata | None:
    """Return the metadata of a rosbag2 folder; None if metadata.yaml is missing or lacks a required entry."""
    file = folder / "metadata.yaml"
    if not file.is_file():
        return None
    try:
        content = yaml.safe_load(file.read_bytes())["rosbag2_bagfile_information"]
        return BagMetadata(
            storage=str(content["storage_identifier"]),
            is_compressed=str(content.get("compression_mode", "")).lower() in ("message", "file"),
            files=tuple(PurePosixPath(path).name for path in content["relative_file_paths"]),
            message_count=int(content["message_count"]),
        )
    except (yaml.YAMLError, LookupError, TypeError, ValueError, AttributeError, RecursionError):
        return None
