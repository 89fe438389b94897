"""What the robot was told: /scan, /odom, /imu, bumpers and pictures."""

import re
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

from simscen.core.geometry import Pose3
from simscen.core.messages.sensor_data import Bump, Image, Imu, Odometry, Readings, Scan
from simscen.record import frame_names, topics
from simscen.record.messages import encode
from simscen.record.messages.encode_arrays import LaserScanPacker, TransformsPacker
from simscen.record.publishers.channels import BatchWriter, MessageSink, TopicWriter
from simscen.record.simtime import SimTime, Stamp
from simscen.record.topics import Topic
from simscen.record.trace_thinning import Thinning

_START: Stamp = (0, 0)
_PRESSED, _FREE = encode.boolean(True), encode.boolean(False)
_DEFAULT_TOPICS = {
    "Scan": ("scan", topics.SCAN_TYPE),
    "Odometry": ("odom", topics.ODOMETRY_TYPE),
    "Imu": ("imu", topics.IMU_TYPE),
    "Bump": ("bumper", topics.BUMPER_TYPE),
}
"""Kind of reading, a class of simscen.core.messages.sensor_data → its plain topic, and the type of it."""


class SensorPublisher:
    """Writes readings. The first sensor of a kind gets the plain topic, others theirs under their name.

    `sensors` are the kinds of their readings by name, in order, as far as known; of others the first that speaks is the
    first. `declared` are the known ones with their topics.

    Messages are written when the stack received them; their header's stamp is when they were measured.
    """

    def __init__(
        self,
        out: MessageSink,
        time: SimTime,
        thinning: Thinning,
        mounts: Mapping[str, Pose3],
        sensors: Mapping[str, str] | None = None,
        names: frame_names.RobotFrames | None = None,
    ) -> None:
        self._out, self._time, self._thinning = out, time, thinning
        self._topics: dict[tuple[str, str], Topic] = {}
        self._lines: dict[tuple[str, str], TopicWriter] = {}
        self._imus: dict[str, BatchWriter] = {}
        self._with_transforms: _OdometryWriters | None = None
        self._filtered: _OdometryWriters | None = None
        self._takers: dict[type, Callable[[int, Any], None]] = {
            Odometry: self._write_odometry,
            Scan: self._write_scan,
            Imu: self._write_imu,
            Bump: self._write_bump,
            Image: self._write_image,
        }
        self._plain: set[str] = set()
        self._scans: dict[str, LaserScanPacker] = {}
        self._names = names or frame_names.RobotFrames()
        self._odometry = encode.odometry_with_covariance(self._names.odom, self._names.base).packer()
        self._transforms = TransformsPacker()
        self._mounts = dict(mounts)
        self._correction: Pose3 | None = None
        self.declared = [(name, topic) for name, kind in (sensors or {}).items() for topic in self._known(name, kind)]
        self._publish_mounts(0)

    def correct(self, map_from_odom: Pose3) -> None:
        """What the localizer says: goes out on /tf with each odometry from now on."""
        self._correction = map_from_odom

    def write_filtered(self, now: int, odometry: Odometry) -> None:
        """Write the odometry of the stack's filter at `now` nanoseconds.

        From now on the filter, and not the wheel odometry, defines the transform from odom to base on /tf.
        """
        if self._filtered is None:
            self._filtered = self._odometry_writers(topics.FILTERED_ODOMETRY)
        self._write_with_transforms(self._filtered, now, odometry)

    def write(self, now: int, readings: Readings) -> None:
        """Write the readings of a beat at `now` nanoseconds."""
        for reading in readings:
            self._takers[type(reading)](now, reading)

    def topic_of(self, reading: Odometry | Scan) -> Topic:
        """The topic on which a reading is written."""
        return self._topic(reading.sensor, *_DEFAULT_TOPICS[type(reading).__name__])

    def _known(self, sensor: str, kind: str) -> list[Topic]:
        if kind == "Image":
            return [image for image, _ in _image_topics(sensor)]
        return [self._topic(sensor, *_DEFAULT_TOPICS[kind])] if kind in _DEFAULT_TOPICS else []

    def _write_odometry(self, now: int, odometry: Odometry) -> None:
        if not self._thinning.keeps_odometry(odometry) or self._filtered is not None:
            self._line("Odometry", odometry.sensor).write(now, self._odometry(*self._odometry_fields(odometry)))
            return
        if self._with_transforms is None:
            self._with_transforms = self._odometry_writers(self.topic_of(odometry))
        self._write_with_transforms(self._with_transforms, now, odometry)

    def _odometry_fields(self, odometry: Odometry) -> tuple[Any, ...]:
        stamp, pose = self._time.stamp(odometry.tick), Pose3.planar(odometry.pose)
        return stamp, pose, odometry.pose_covariance, odometry.twist, odometry.twist_variance

    def _write_with_transforms(self, writers: "_OdometryWriters", now: int, odometry: Odometry) -> None:
        fields = self._odometry_fields(odometry)
        if self._correction is None:
            writers.uncorrected.write(now, *fields)
        else:
            writers.corrected.write(now, *fields, self._correction)

    def _odometry_writers(self, topic: Topic) -> "_OdometryWriters":
        odom, base = self._names.odom, self._names.base
        layout = topic, encode.odometry_with_covariance(odom, base)
        links = (odom, base, "pose"), (frame_names.MAP, odom, "correction")
        uncorrected, corrected = ((topics.TF, encode.transforms(each)) for each in (links[:1], links))
        return _OdometryWriters(self._out.together((layout, uncorrected)), self._out.together((layout, corrected)))

    def _write_scan(self, now: int, scan: Scan) -> None:
        packer = self._scans.get(scan.sensor)
        if packer is None:
            packer = self._scans[scan.sensor] = LaserScanPacker(self._names.of_sensor(scan.sensor))
        if scan.sensor not in self._mounts:
            self._mounts[scan.sensor] = Pose3.planar(scan.mount)
            self._publish_mounts(now)
        self._line("Scan", scan.sensor).write(now, packer(self._time.stamp(scan.tick), scan))

    def _write_imu(self, now: int, imu: Imu) -> None:
        together = self._imus.get(imu.sensor)
        if together is None:
            topic = self._topic(imu.sensor, *_DEFAULT_TOPICS["Imu"])
            together = self._imus[imu.sensor] = self._out.together([(topic, encode.imu(self._names.base))])
        together.write(
            now, self._time.stamp(imu.tick),
            imu.angular_velocity, imu.angular_velocity_variance,
            imu.linear_acceleration, imu.linear_acceleration_variance,
        )  # fmt: skip

    def _write_bump(self, now: int, bump: Bump) -> None:
        self._line("Bump", bump.sensor).write(now, _PRESSED if bump.pressed else _FREE)

    def _write_image(self, now: int, image: Image) -> None:
        frame, stamp = self._names.of_sensor(image.sensor), self._time.stamp(image.tick)
        for topic, depth in _image_topics(image.sensor):
            pixels = image.depth if depth else image.rgb
            if pixels.size:
                self._out.publish(topic, now, encode.image(frame, stamp, pixels))

    def _publish_mounts(self, now: int) -> None:
        """All static frames at once: a late subscriber gets only the last message."""
        base = self._names.base
        links = [(base, self._names.of_sensor(name), _START, pose) for name, pose in self._mounts.items()]
        if links:
            self._out.publish(topics.TF_STATIC, now, self._transforms(links))

    def _line(self, kind: str, sensor: str) -> TopicWriter:
        line = self._lines.get((kind, sensor))
        if line is None:
            line = self._lines[kind, sensor] = self._out.line(self._topic(sensor, *_DEFAULT_TOPICS[kind]))
        return line

    def _topic(self, sensor: str, plain: str, kind: str) -> Topic:
        topic = self._topics.get((sensor, plain))
        if topic is None:
            name = f"/{_ros_name(sensor)}/{plain}" if plain in self._plain else f"/{plain}"
            self._plain.add(plain)
            topic = self._topics[sensor, plain] = Topic(name, kind)
        return topic


class _OdometryWriters(NamedTuple):
    """Writers of odometry together with odom→base on /tf: without map→odom, and with it."""

    uncorrected: BatchWriter
    corrected: BatchWriter


def _image_topics(sensor: str) -> list[tuple[Topic, bool]]:
    """A camera's topics; whether they tell depths."""
    root = f"/{_ros_name(sensor)}"
    names = ("image_raw", False), ("depth/image_raw", True)
    return [(Topic(f"{root}/{name}", topics.IMAGE_TYPE), depth) for name, depth in names]


def _ros_name(text: str) -> str:
    """`text` as the root of a sensor's topic: ROS allows letters, digits and underscores, and no digit first.

    A sensor called ground_truth must not speak on the truth's topic.
    """
    name = re.sub(r"[^A-Za-z0-9_]", "_", text)
    return f"sensor_{name}" if name[:1].isdigit() or name in ("", "ground_truth") else name
