"""Tests that the shipped message definitions are those of ROS 2 Humble."""

import json

from schemas_from_rosbags import SCHEMAS, expected_schemas

from simscen.record import topics
from simscen.record.topics import Topic, load_message_types


def test_schemas_equal_those_of_rosbags() -> None:
    assert json.loads(SCHEMAS.read_text()) == expected_schemas()


def test_every_topic_has_a_shipped_message_type() -> None:
    types = {topic.type for topic in vars(topics).values() if isinstance(topic, Topic)}
    types |= {value for name, value in vars(topics).items() if name.endswith("_TYPE")}
    assert types == set(load_message_types())
