"""Synthetic logs of a real robot, written by the rosbags and mcap libraries with the definitions of rosbags."""

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from mcap.writer import CompressionType, IndexType
from mcap.writer import Writer as McapWriter
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

STORE = get_typestore(Stores.ROS2_HUMBLE)
T: dict[str, Any] = STORE.types
SECOND = 1_000_000_000
BEGIN = 1_700_000_000 * SECOND
LATENCY = 20_000_000
"""Time in ns between the stamp and the logging of a message."""
SPEED = 0.5
"""Speed of the robot in m/s."""


@dataclass(frozen=True)
class Message:
    """Message with its topic and its log time in ns."""

    topic: str
    time: int
    message: Any


def drive(seconds: float = 10.0, begin: int = BEGIN, off: float = 0.05, mocap: str = "map") -> list[Message]:
    """Return the log of a robot that drives along the x axis at 0.5 m/s.

    The estimate on /amcl_pose is `off` m ahead of the true pose on /mocap, whose frame is `mocap`.
    """
    messages = []
    for k in range(round(seconds * 20) + 1):
        t = k / 20
        stamp = begin + round(t * SECOND)
        pose = stamped_pose(stamp, mocap, SPEED * t)
        messages.append(Message("/mocap", stamp + LATENCY, pose))
        messages.append(Message("/odom", stamp + LATENCY, odometry(stamp, "odom", SPEED * t, SPEED)))
        messages.append(Message("/cmd_vel", stamp + LATENCY, twist(SPEED)))
        if k % 10 == 0:
            messages.append(Message("/amcl_pose", stamp + 5 * LATENCY, estimated_pose(stamp, SPEED * t + off)))
            messages.append(Message("/scan", stamp + LATENCY, scan(stamp)))
    return messages


def stamp_of(time: int) -> Any:
    """Return a builtin_interfaces/Time."""
    return T["builtin_interfaces/msg/Time"](sec=time // SECOND, nanosec=time % SECOND)


def header(time: int, frame: str) -> Any:
    """Return a std_msgs/Header."""
    return T["std_msgs/msg/Header"](stamp=stamp_of(time), frame_id=frame)


def pose(x: float, y: float = 0.0, yaw: float = 0.0) -> Any:
    """Return a geometry_msgs/Pose."""
    orientation = T["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=math.sin(yaw / 2), w=math.cos(yaw / 2))
    return T["geometry_msgs/msg/Pose"](position=T["geometry_msgs/msg/Point"](x=x, y=y, z=0.0), orientation=orientation)


def stamped_pose(time: int, frame: str, x: float) -> Any:
    """Return a geometry_msgs/PoseStamped."""
    return T["geometry_msgs/msg/PoseStamped"](header=header(time, frame), pose=pose(x))


def twist(forward: float) -> Any:
    """Return a geometry_msgs/Twist."""
    vector = T["geometry_msgs/msg/Vector3"]
    return T["geometry_msgs/msg/Twist"](linear=vector(x=forward, y=0.0, z=0.0), angular=vector(x=0.0, y=0.0, z=0.0))


def odometry(time: int, frame: str, x: float, forward: float) -> Any:
    """Return a nav_msgs/Odometry."""
    position = T["geometry_msgs/msg/PoseWithCovariance"](pose=pose(x), covariance=np.zeros(36))
    velocity = T["geometry_msgs/msg/TwistWithCovariance"](twist=twist(forward), covariance=np.zeros(36))
    message = T["nav_msgs/msg/Odometry"]
    return message(header=header(time, frame), child_frame_id="base_link", pose=position, twist=velocity)


def estimated_pose(time: int, x: float) -> Any:
    """Return a geometry_msgs/PoseWithCovarianceStamped."""
    covariance = np.zeros(36)
    covariance[[0, 7, 35]] = 0.01
    estimate = T["geometry_msgs/msg/PoseWithCovariance"](pose=pose(x), covariance=covariance)
    return T["geometry_msgs/msg/PoseWithCovarianceStamped"](header=header(time, "map"), pose=estimate)


def scan(time: int) -> Any:
    """Return a sensor_msgs/LaserScan."""
    ranges = np.full(8, 2.0, dtype=np.float32)
    return T["sensor_msgs/msg/LaserScan"](
        header=header(time, "lidar"), angle_min=-1.0, angle_max=1.0, angle_increment=0.25, time_increment=0.0,
        scan_time=0.1, range_min=0.1, range_max=10.0, ranges=ranges, intensities=np.zeros(0, dtype=np.float32),
    )  # fmt: skip


def link(time: int, parent: str, child: str, x: float, y: float = 0.0, yaw: float = 0.0) -> Any:
    """Return a tf2_msgs/TFMessage with one transform."""
    child_pose = pose(x, y, yaw)
    translation = T["geometry_msgs/msg/Vector3"](x=x, y=y, z=0.0)
    transform = T["geometry_msgs/msg/Transform"](translation=translation, rotation=child_pose.orientation)
    stamped = T["geometry_msgs/msg/TransformStamped"](
        header=header(time, parent), child_frame_id=child, transform=transform
    )
    return T["tf2_msgs/msg/TFMessage"](transforms=[stamped])


def statuses(*goals: tuple[int, int, int]) -> Any:
    """Return an action_msgs/GoalStatusArray of goals (id, time of acceptance in ns, status)."""
    uuid, info = T["unique_identifier_msgs/msg/UUID"], T["action_msgs/msg/GoalInfo"]
    status_list = [
        T["action_msgs/msg/GoalStatus"](
            goal_info=info(goal_id=uuid(uuid=np.full(16, number, dtype=np.uint8)), stamp=stamp_of(accepted)),
            status=status,
        )
        for number, accepted, status in goals
    ]
    return T["action_msgs/msg/GoalStatusArray"](status_list=status_list)


def write_bag(
    folder: Path, messages: Iterable[Message], plugin: StoragePlugin = StoragePlugin.SQLITE3, compress: str = ""
) -> Path:
    """Write a rosbag2 with rosbags; `compress` is file or message."""
    writer = Writer(folder, version=9, storage_plugin=plugin)
    if compress:
        writer.set_compression(CompressionMode[compress.upper()], CompressionFormat.ZSTD)
    with writer:
        connections: dict[str, Any] = {}
        for entry in messages:
            kind = entry.message.__msgtype__
            if entry.topic not in connections:
                connections[entry.topic] = writer.add_connection(entry.topic, kind, typestore=STORE)
            writer.write(connections[entry.topic], entry.time, bytes(STORE.serialize_cdr(entry.message, kind)))
    return folder


def write_mcap(
    file: Path,
    messages: Iterable[Message],
    profile: str = "ros2",
    encoding: str = "cdr",
    change: Callable[[bytes], bytes] = bytes,
    **options: Any,
) -> Path:
    """Write an MCAP file with the mcap library; `change` modifies the bytes of each message."""
    with file.open("wb") as stream:
        writer = McapWriter(stream, **options)
        writer.start(profile, "other recorder")
        channels: dict[str, int] = {}
        for number, entry in enumerate(messages):
            kind = entry.message.__msgtype__
            if entry.topic not in channels:
                definition, _ = STORE.generate_msgdef(kind, ros_version=2)
                schema = writer.register_schema(kind, "ros2msg", definition.encode())
                channels[entry.topic] = writer.register_channel(entry.topic, encoding, schema)
            data = change(bytes(STORE.serialize_cdr(entry.message, kind)))
            writer.add_message(channels[entry.topic], entry.time, data, entry.time, number)
        writer.finish()
    return file


UNINDEXED: dict[str, Any] = {"use_chunking": False, "index_types": IndexType.NONE, "use_statistics": False}
CHUNKED: dict[str, dict[str, Any]] = {kind.name: {"compression": kind} for kind in CompressionType}
