"""Tests of rosbag2 folders: split bags, and storage that does not match metadata.yaml."""

from dataclasses import replace
from pathlib import Path

import pytest
import yaml
from foreign_logs import Message, drive, write_bag, write_mcap
from rosbags.rosbag2 import StoragePlugin

from simscen.core.errors import InvalidInput
from simscen.record.foreign.options import ForeignLogOptions
from simscen.record.foreign.read import ForeignLog, read_foreign_log

TRUNCATED = "the log is truncated, so no criterion can pass"


def split_bag(folder: Path, messages: list[Message], parts: int) -> Path:
    """Write a rosbag2 of several MCAP files, as `ros2 bag record --max-bag-duration` does."""
    write_bag(folder, messages, StoragePlugin.MCAP)
    (whole,) = folder.glob("*.mcap")
    whole.unlink()
    names = [f"{folder.name}_{part}.mcap" for part in range(parts)]
    for part, name in enumerate(names):
        write_mcap(folder / name, messages[part * len(messages) // parts : (part + 1) * len(messages) // parts])
    change_metadata(folder, relative_file_paths=names)
    return folder


def change_metadata(folder: Path, **changes: object) -> None:
    file = folder / "metadata.yaml"
    content = yaml.safe_load(file.read_text())
    content["rosbag2_bagfile_information"].update(changes)
    file.write_text(yaml.safe_dump(content))


def read(path: Path) -> ForeignLog:
    return read_foreign_log(path, ForeignLogOptions(truth="/mocap"))


def test_files_of_a_split_bag_are_one_log(tmp_path: Path) -> None:
    log = read(split_bag(tmp_path / "bag", drive(), 12))
    assert len(log.trace.truth) == 201
    assert not log.notes


@pytest.mark.parametrize("plugin", [StoragePlugin.SQLITE3, StoragePlugin.MCAP])
def test_a_topic_without_a_slash_is_read_as_an_absolute_topic(tmp_path: Path, plugin: StoragePlugin) -> None:
    """Such topics are common in bags that were converted from ROS 1."""
    relative = [replace(message, topic=message.topic[1:]) for message in drive()]
    log = read(write_bag(tmp_path / "bag", relative, plugin))
    assert len(log.trace.truth) == 201
    assert len(log.trace.belief) == 21


@pytest.mark.parametrize("part", [0, 1, 2])
def test_a_split_bag_without_one_of_its_files_is_refused(tmp_path: Path, part: int) -> None:
    """Otherwise, the criteria would pass on the remaining part of the drive."""
    bag = split_bag(tmp_path / "bag", drive(), 3)
    (bag / f"bag_{part}.mcap").unlink()
    with pytest.raises(InvalidInput, match=f"metadata.yaml lists bag_{part}.mcap, which is missing"):
        read(bag)


@pytest.mark.parametrize("plugin", [StoragePlugin.SQLITE3, StoragePlugin.MCAP])
def test_a_bag_with_fewer_messages_than_its_metadata_lists_is_truncated(tmp_path: Path, plugin: StoragePlugin) -> None:
    bag = write_bag(tmp_path / "bag", drive(), plugin)
    content = yaml.safe_load((bag / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    topics = [{**topic, "message_count": 500} for topic in content["topics_with_message_count"]]
    change_metadata(bag, message_count=2500, topics_with_message_count=topics)
    assert read(bag).notes == [TRUNCATED]


def test_files_that_the_metadata_does_not_list_are_ignored(tmp_path: Path) -> None:
    bag = write_bag(tmp_path / "bag", drive())
    write_mcap(bag / "excerpt.mcap", drive(3.0))
    assert len(read(bag).trace.truth) == 201


@pytest.mark.parametrize("content", ["", "[", "rosbag2_bagfile_information: 1", "&a [*a]"])
def test_mcap_files_with_invalid_metadata_are_read(tmp_path: Path, content: str) -> None:
    bag = write_bag(tmp_path / "bag", drive(), StoragePlugin.MCAP)
    (bag / "metadata.yaml").write_text(content)
    assert len(read(bag).trace.truth) == 201


def test_a_file_of_two_logs_is_refused(tmp_path: Path) -> None:
    log = write_mcap(tmp_path / "a.mcap", drive())
    log.write_bytes(2 * log.read_bytes())
    with pytest.raises(InvalidInput, match="data follows its end"):
        read(log)
