"""What an external stack hears: the messages of a log, packed by what packs the log, as far as it wants them."""

from __future__ import annotations

from array import array
from collections.abc import Collection, Iterator, Mapping
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.geometry import Array, Pose3
from simscen.core.messages.localization import Estimate
from simscen.core.messages.sensor_data import Odometry, Reading, Readings, Scan
from simscen.peer import messages
from simscen.record import frames, pack, pack_many, pack_rare, topics
from simscen.record.out import Layouts, Line, Together
from simscen.record.sensor_topics import SensorTopics
from simscen.record.simtime import SimTime
from simscen.record.thinning import Thinning
from simscen.record.topics import Topic
from simscen.run.external.protocol import EXACT_SUFFIX, FLOAT64_ARRAY, INITIAL_POSE, POSE2D, TopicTable

if TYPE_CHECKING:
    from simscen.peer.wire import Messages

_START = (0, 0)


class StepPublisher:
    """Collects what is to be said with the next step."""

    def __init__(self, tick_rate: int, sensors: Mapping[str, str], mounts: Mapping[str, Pose3]) -> None:
        """`sensors` are the kinds of readings by sensor, in the order of the robot; `mounts` where they sit on it."""
        self._waiting: Messages = []
        self._numbers: dict[str, int] = {}
        self._heard: frozenset[str] = frozenset()
        self._listened: set[str] = set()
        self._latched: list[tuple[Topic, bytes]] = []
        self._time = SimTime(tick_rate)
        self._sensors = SensorTopics(self, self._time, Thinning(tick_rate), mounts, sensors)
        self.named = self._sensors.declared

    def latch(self, grid: OccupancyGrid | None, topic: Topic) -> None:
        """A map or a mask, where there is one: comes with the first step."""
        if grid is not None:
            self._latched.append((topic, pack_many.occupancy_grid(frames.MAP, _START, grid)))

    def latch_robot(self, description: str, estimate: Estimate) -> None:
        """What is known of the robot from the start."""
        self._latched.append((topics.ROBOT_DESCRIPTION, pack_rare.string(description)))
        if estimate.pose is not None:
            told = pack.pose_with_covariance(frames.MAP).packer()
            covariance = np.diag(np.square(estimate.std)).ravel().tolist()
            self._latched.append((INITIAL_POSE, told(_START, Pose3.planar(estimate.pose), covariance)))

    def offer(self) -> TopicTable:
        """All that can be heard."""
        says: list[Topic] = []
        for _, topic in self.named:
            says += [topic, *_exact(topic)]
        known = dict.fromkeys(topic for topic, _ in self._latched)
        return TopicTable.of([*says, topics.TF, *known])

    def want(self, offer: TopicTable, names: Collection[str]) -> None:
        """From now on these are collected, the latched ones first."""
        self._numbers, self._heard = offer.numbers, frozenset(names)
        self._listened = {
            sensor
            for sensor, topic in self.named
            if self._heard.intersection((topic.name, topic.name + EXACT_SUFFIX))
            or (topic.type == topics.ODOMETRY_TYPE and topics.TF.name in self._heard)
        }
        for topic, data in self._latched:
            self.publish(topic, 0, data)

    def take(self, tick: int, readings: Readings) -> None:
        """The readings of a beat."""
        now = self._time.nanoseconds(tick)
        for reading in readings:
            if reading.sensor not in self._listened:
                continue
            self._sensors.write(now, (reading,))
            for name, data in self._exactly(reading):
                self._put(name, data)

    @property
    def waiting(self) -> bool:
        """Whether there is anything to be heard."""
        return bool(self._waiting)

    def drain(self) -> Messages:
        """What has been collected since this was last asked."""
        messages, self._waiting = self._waiting, []
        return messages

    def line(self, topic: Topic) -> Line:
        """As record's Publisher."""
        return Line(lambda: partial(self.publish, topic))

    def together(self, messages: Layouts) -> Together:
        """As record's Publisher."""
        return Together(self, messages)

    def publish(self, topic: Topic, time: int, data: bytes) -> None:
        """As record's Publisher, with a stack instead of a log."""
        if topic is topics.TF_STATIC and not self._numbers:  # before anybody was asked: where the sensors sit
            self._latched.append((topic, data))
        self._put(topic.name, data)

    def _put(self, name: str, data: bytes) -> None:
        if name in self._heard:
            self._waiting.append((self._numbers[name], data))

    def _exactly(self, reading: Reading) -> Iterator[tuple[str, bytes]]:
        match reading:
            case Scan():
                name = self._sensors.topic_of(reading).name + EXACT_SUFFIX
                if name in self._heard:
                    yield name, messages.float64_array(array("d", _scan(reading).tobytes()))
            case Odometry():
                name = self._sensors.topic_of(reading).name + EXACT_SUFFIX
                if name in self._heard:
                    yield name, messages.pose2d(*reading.pose)
            case _:
                pass


def _exact(topic: Topic) -> list[Topic]:
    kinds = {topics.SCAN_TYPE: FLOAT64_ARRAY, topics.ODOMETRY_TYPE: POSE2D}
    return [Topic(topic.name + EXACT_SUFFIX, kinds[topic.type])] if topic.type in kinds else []


def _scan(scan: Scan) -> Array:
    """First angle, angle between beams, shortest and longest range, the lidar's x, y, yaw, then the ranges."""
    head = (scan.angle_min, scan.angle_increment, scan.range_min, scan.range_max, *scan.mount)
    return np.concatenate((np.array(head, dtype=np.float64), scan.ranges))
