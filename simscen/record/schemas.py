"""The message definitions of ROS 2 Humble, so that neither ROS nor rosbags is needed to write a log."""

import json
from importlib.resources import files
from typing import NamedTuple


class MessageType(NamedTuple):
    """A message type's full name, its definition with those it contains (ros2msg), and its hash (REP 2016)."""

    name: str
    definition: str
    hash: str


def load() -> dict[str, MessageType]:
    """All types a log can hold, by name; schemas.json is generated from rosbags and checked for drift."""
    table = json.loads(files(__package__).joinpath("schemas.json").read_text("utf-8"))
    return {name: MessageType(name, entry["definition"], entry["hash"]) for name, entry in table.items()}
