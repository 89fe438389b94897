"""Publisher of sensor readings, of odometry on /tf, and of the poses of sensors on /tf_static."""

import re
from collections.abc import Callable, Mapping
from itertools import chain, count
from typing import Any, NamedTuple

from simscen.core.clock import Clock, Stamp
from simscen.core.geometry import Pose3
from simscen.core.messages.sensor_data import Bump, Image, Imu, Odometry, Readings, Scan
from simscen.record import frame_names, topics
from simscen.record.messages import encode, message_templates
from simscen.record.publishers.message_sinks import BatchWriter, MessageSink
from simscen.record.topics import Topic
from simscen.record.trace_thinning import Thinning

_START: Stamp = (0, 0)
"""Stamp of transforms on /tf_static."""
_PRESSED_MESSAGE, _FREE_MESSAGE = encode.boolean(True), encode.boolean(False)
"""Serialized messages of a bumper."""
_DEFAULT_TOPICS = {
    "Scan": ("scan", topics.SCAN_TYPE),
    "Odometry": ("odom", topics.ODOMETRY_TYPE),
    "Imu": ("imu", topics.IMU_TYPE),
    "Bump": ("bumper", topics.BUMPER_TYPE),
}
"""Default topic (without the slash) and message type, by the class name of a reading."""


class SensorPublisher:
    """Publishes readings when the stack receives them. Stamps are the times of measurement.

    The first sensor of a type has the default topic, e.g. /scan. The topics of further sensors of this type, and of all
    cameras, start with the name of the sensor, e.g. /rear/scan. In the topic, `_` replaces characters that ROS names
    cannot contain, and a number distinguishes equal names.

    Args:
        mounts: Poses of sensors on the base, by sensor name.
        sensors: Class names of readings ("Scan", …) by sensor name. Topics are assigned in this order. A sensor that
            is missing here gets its topic with its first reading.

    Attributes:
        sensor_topics: Pairs of sensor name and topic for all `sensors`.
        map_from_odom: Transform that is published on /tf with each odometry; None while it is unknown.
    """

    def __init__(
        self,
        out: MessageSink,
        clock: Clock,
        thinning: Thinning,
        mounts: Mapping[str, Pose3],
        sensors: Mapping[str, str],
        frames: frame_names.RobotFrames,
    ) -> None:
        self._out, self._clock, self._thinning = out, clock, thinning
        self._topics: dict[tuple[str, str], Topic] = {}
        self._imu_writers: dict[str, BatchWriter] = {}
        self._wheel_odometry: _OdometryWriters | None = None
        self._filtered_odometry: _OdometryWriters | None = None
        self._methods: dict[type, Callable[[int, Any], None]] = {
            Odometry: self._write_odometry,
            Scan: self._write_scan,
            Imu: self._write_imu,
            Bump: self._write_bump,
            Image: self._write_image,
        }
        self._used_defaults: set[str] = set()
        self._namespaces: dict[str, str] = {}
        self._frames = frames
        self._pack_odometry = message_templates.odometry_with_covariance(self._frames.odom, self._frames.base).packer()
        self._mounts = dict(mounts)
        self.map_from_odom: Pose3 | None = None
        self.sensor_topics = [(name, topic) for name, kind in sensors.items() for topic in self._topics_of(name, kind)]
        self._publish_mounts(0)

    def write_filtered(self, now: int, odometry: Odometry) -> None:
        """Publish the filtered odometry of the stack. `now` is simulated time in ns.

        After the first call, the transform from odom to base on /tf comes from the filter, not from the wheel odometry.
        """
        if self._filtered_odometry is None:
            self._filtered_odometry = self._odometry_writers(topics.FILTERED_ODOMETRY)
        self._write_with_transforms(self._filtered_odometry, now, odometry)

    def write(self, now: int, readings: Readings) -> None:
        """Publish readings. `now` is simulated time in ns."""
        for reading in readings:
            self._methods[type(reading)](now, reading)

    def topic_of(self, reading: Odometry | Scan) -> Topic:
        """Return the topic on which a reading is published."""
        return self._topic(reading.sensor, type(reading).__name__)

    def _topics_of(self, sensor: str, kind: str) -> list[Topic]:
        if kind == "Image":
            return [image for image, _ in self._image_topics(sensor)]
        return [self._topic(sensor, kind)] if kind in _DEFAULT_TOPICS else []

    def _write_odometry(self, now: int, odometry: Odometry) -> None:
        if not self._thinning.keeps_odometry(odometry) or self._filtered_odometry is not None:
            self._out.publish(self.topic_of(odometry), now, self._pack_odometry(*self._odometry_fields(odometry)))
            return
        if self._wheel_odometry is None:
            self._wheel_odometry = self._odometry_writers(self.topic_of(odometry))
        self._write_with_transforms(self._wheel_odometry, now, odometry)

    def _odometry_fields(self, odometry: Odometry) -> tuple[Any, ...]:
        stamp, pose = self._clock.stamp(odometry.tick), Pose3.planar(odometry.pose)
        return stamp, pose, odometry.pose_covariance, odometry.twist, odometry.twist_variance

    def _write_with_transforms(self, writers: "_OdometryWriters", now: int, odometry: Odometry) -> None:
        fields = self._odometry_fields(odometry)
        if self.map_from_odom is None:
            writers.without_map.write(now, *fields)
        else:
            writers.with_map.write(now, *fields, self.map_from_odom)

    def _odometry_writers(self, topic: Topic) -> "_OdometryWriters":
        odom, base = self._frames.odom, self._frames.base
        odometry = topic, message_templates.odometry_with_covariance(odom, base)
        links = (odom, base, "pose"), (frame_names.MAP, odom, "map_from_odom")
        return _OdometryWriters(
            self._out.batch_writer((odometry, (topics.TF, message_templates.transforms(links[:1])))),
            self._out.batch_writer((odometry, (topics.TF, message_templates.transforms(links)))),
        )

    def _write_scan(self, now: int, scan: Scan) -> None:
        if scan.sensor not in self._mounts:
            self._mounts[scan.sensor] = scan.tilted_mount or Pose3.planar(scan.mount)
            self._publish_mounts(now)
        data = encode.laser_scan(self._frames.sensor_frame(scan.sensor), self._clock.stamp(scan.tick), scan)
        self._out.publish(self.topic_of(scan), now, data)

    def _write_imu(self, now: int, imu: Imu) -> None:
        writer = self._imu_writers.get(imu.sensor)
        if writer is None:
            topic = self._topic(imu.sensor, "Imu")
            frame = self._frames.sensor_frame(imu.sensor) if imu.sensor in self._mounts else self._frames.base
            writer = self._imu_writers[imu.sensor] = self._out.batch_writer([(topic, message_templates.imu(frame))])
        writer.write(
            now, self._clock.stamp(imu.tick),
            imu.angular_velocity, imu.angular_velocity_variance,
            imu.linear_acceleration, imu.linear_acceleration_variance,
        )  # fmt: skip

    def _write_bump(self, now: int, bump: Bump) -> None:
        self._out.publish(self._topic(bump.sensor, "Bump"), now, _PRESSED_MESSAGE if bump.pressed else _FREE_MESSAGE)

    def _write_image(self, now: int, image: Image) -> None:
        frame, stamp = self._frames.sensor_frame(image.sensor), self._clock.stamp(image.tick)
        for topic, is_depth in self._image_topics(image.sensor):
            pixels = image.depth if is_depth else image.rgb
            if pixels.size:
                self._out.publish(topic, now, encode.image(frame, stamp, pixels))

    def _publish_mounts(self, now: int) -> None:
        base = self._frames.base
        links = [(base, self._frames.sensor_frame(name), _START, pose) for name, pose in self._mounts.items()]
        if links:
            self._out.publish(topics.TF_STATIC, now, encode.tf_message(links))

    def _topic(self, sensor: str, kind: str) -> Topic:
        """Return the topic of a sensor: `/default` for the first sensor of a kind, `/NAME/default` for the others."""
        topic = self._topics.get((sensor, kind))
        if topic is None:
            default, message_type = _DEFAULT_TOPICS[kind]
            name = f"/{self._namespace(sensor)}/{default}" if default in self._used_defaults else f"/{default}"
            self._used_defaults.add(default)
            topic = self._topics[sensor, kind] = Topic(name, message_type)
        return topic

    def _image_topics(self, sensor: str) -> list[tuple[Topic, bool]]:
        """Return pairs for a camera: a topic, and whether its images contain depths instead of colors."""
        namespace = self._namespace(sensor)
        names = ("image_raw", False), ("depth/image_raw", True)
        return [(Topic(f"/{namespace}/{name}", topics.IMAGE_TYPE), is_depth) for name, is_depth in names]

    def _namespace(self, sensor: str) -> str:
        """Return the namespace of a sensor's topics, with a number if another sensor has the same ROS name."""
        if sensor not in self._namespaces:
            name = _ros_name(sensor)
            numbered_names = (f"{name}_{number}" for number in count(2))
            other_names = set(self._namespaces.values())
            self._namespaces[sensor] = next(n for n in chain([name], numbered_names) if n not in other_names)
        return self._namespaces[sensor]


class _OdometryWriters(NamedTuple):
    """Writers of odometry and of odom→base on /tf. `with_map` also writes map→odom."""

    without_map: BatchWriter
    with_map: BatchWriter


def _ros_name(text: str) -> str:
    """Return a valid ROS name for a sensor. It is never `ground_truth`, which is a namespace."""
    name = re.sub(r"[^A-Za-z0-9_]", "_", text)
    return f"sensor_{name}" if name[:1].isdigit() or name in ("", "ground_truth") else name
