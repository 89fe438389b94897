"""Queue of the ROS messages for an external stack: sensor readings, maps, and masks."""

from __future__ import annotations

from array import array
from collections.abc import Collection, Iterable, Mapping
from typing import TYPE_CHECKING

import numpy as np

from simscen.core.clock import Clock
from simscen.core.environment.occupancy_grid import OccupancyGrid
from simscen.core.geometry import Pose3
from simscen.core.messages.navigation import Estimate
from simscen.core.messages.sensor_data import Odometry, Readings, Scan
from simscen.peer import messages
from simscen.record import frame_names, topics
from simscen.record.frame_names import RobotFrames
from simscen.record.messages import encode, message_templates
from simscen.record.publishers.message_sinks import BatchWriter, Layouts
from simscen.record.publishers.sensors import SensorPublisher
from simscen.record.topics import Topic
from simscen.record.trace_thinning import Thinning
from simscen.run.external.protocol import EXACT_SUFFIX, FLOAT64_ARRAY, INITIAL_POSE, POSE2D

if TYPE_CHECKING:
    from simscen.peer.wire import Messages

_FIRST_STAMP = (0, 0)
"""Time stamp at the start of the run: seconds and nanoseconds."""


class StepPublisher:
    """Queue of the ROS messages for the next STEP frame of the stack protocol.

    Implements MessageSink, to which the encoders of the messages write.
    """

    def __init__(self, tick_rate: int, sensors: Mapping[str, str], mounts: Mapping[str, Pose3]) -> None:
        """`sensors` are the reading types, such as "Scan", and `mounts` the poses in the base frame, by sensor name."""
        self._queue: Messages = []
        self._numbers: dict[str, int] = {}
        self._requested_topics: frozenset[str] = frozenset()
        self._requested_sensors: set[str] = set()
        self._latched: list[tuple[Topic, bytes]] = []
        self._time = Clock(tick_rate)
        self._sensors = SensorPublisher(self, self._time, Thinning(tick_rate, sensors), mounts, sensors, RobotFrames())
        self.sensor_topics = self._sensors.sensor_topics
        """Pairs of a sensor name and a topic with readings of that sensor."""

    def latch(self, grid: OccupancyGrid | None, topic: Topic) -> None:
        """Publish a map or mask once, with the first step. Does nothing for None."""
        if grid is not None:
            self._latched.append((topic, encode.occupancy_grid(frame_names.MAP, _FIRST_STAMP, grid)))

    def publish_grid(self, tick: int, grid: OccupancyGrid, topic: Topic) -> None:
        """Publish a map or mask with the next step."""
        data = encode.occupancy_grid(frame_names.MAP, self._time.stamp(tick), grid)
        self.publish(topic, self._time.nanoseconds(tick), data)

    def latch_robot(self, description: str, estimate: Estimate) -> None:
        """Publish the robot description and the initial pose once, with the first step."""
        self._latched.append((topics.ROBOT_DESCRIPTION, messages.string(description)))
        if estimate.pose is not None:
            pack_pose = message_templates.pose_with_covariance(frame_names.MAP).packer()
            covariance = np.diag(np.square(estimate.std)).ravel().tolist()
            self._latched.append((INITIAL_POSE, pack_pose(_FIRST_STAMP, Pose3.planar(estimate.pose), covariance)))

    def available_topics(self) -> dict[str, Topic]:
        """Return all topics to which the stack can subscribe, by name. Call it after all calls of `latch`."""
        sent: list[Topic] = []
        for _, topic in self.sensor_topics:
            sent += [topic, *_exact_topics(topic)]
        latched = [topic for topic, _ in self._latched]
        return {topic.name: topic for topic in (*sent, topics.TF, *latched)}

    def set_subscriptions(self, available: Iterable[str], names: Collection[str]) -> None:
        """Publish only the topics `names` from now on, and queue the latched messages on them.

        `available` are the names of all topics, in the order of `available_topics`. Messages refer to a topic by its
        number in this order, from 1.
        """
        self._numbers = {name: number for number, name in enumerate(available, start=1)}
        self._requested_topics = frozenset(names)
        self._requested_sensors = {
            sensor
            for sensor, topic in self.sensor_topics
            if self._requested_topics.intersection((topic.name, topic.name + EXACT_SUFFIX))
            or (topic.type == topics.ODOMETRY_TYPE and topics.TF.name in self._requested_topics)
        }
        for topic, data in self._latched:
            self.publish(topic, 0, data)

    def publish_readings(self, tick: int, readings: Readings) -> None:
        """Publish the readings that arrive at `tick`."""
        now = self._time.nanoseconds(tick)
        for reading in readings:
            if reading.sensor not in self._requested_sensors:
                continue
            self._sensors.write(now, (reading,))
            if isinstance(reading, Scan | Odometry):
                self._publish_exact(reading)

    @property
    def has_messages(self) -> bool:
        """Whether there are messages in the queue."""
        return bool(self._queue)

    def drain(self) -> Messages:
        """Return all queued messages, and empty the queue."""
        messages, self._queue = self._queue, []
        return messages

    def batch_writer(self, layouts: Layouts) -> BatchWriter:
        """Return a writer for messages that are always published together."""
        return BatchWriter(self, layouts)

    def publish(self, topic: Topic, time: int, data: bytes) -> None:
        """Publish a message if the stack has subscribed to its topic. `time` is the simulated time in ns.

        Static transforms that are published before `set_subscriptions` are kept, and queued by `set_subscriptions`.
        """
        if topic is topics.TF_STATIC and not self._numbers:  # sensor mounts, published before topics are selected
            self._latched.append((topic, data))
        if topic.name in self._requested_topics:
            self._queue.append((self._numbers[topic.name], data))

    def _publish_exact(self, reading: Scan | Odometry) -> None:
        """Publish a reading in full precision, if the stack has subscribed to the exact topic."""
        name = self._sensors.topic_of(reading).name + EXACT_SUFFIX
        if name in self._requested_topics:
            data = _exact_scan(reading) if isinstance(reading, Scan) else messages.pose2d(*reading.pose)
            self._queue.append((self._numbers[name], data))


def _exact_topics(topic: Topic) -> list[Topic]:
    """Return the topic for the values of `topic` in full precision, or an empty list if there is none."""
    kinds = {topics.SCAN_TYPE: FLOAT64_ARRAY, topics.ODOMETRY_TYPE: POSE2D}
    return [Topic(topic.name + EXACT_SUFFIX, kinds[topic.type])] if topic.type in kinds else []


def _exact_scan(scan: Scan) -> bytes:
    """Encode a scan: first angle, angle increment, minimum and maximum range, the lidar's x, y, yaw, and the ranges."""
    head = (scan.angle_min, scan.angle_increment, scan.range_min, scan.range_max, *scan.mount)
    return messages.float64_array(array("d", np.concatenate((head, scan.ranges)).tobytes()))
