"""The topics of a log, with the types and quality of service that ROS 2's nodes would have given them."""

from collections.abc import Mapping
from typing import NamedTuple, Protocol

from simscen.record.schemas import MessageType, load
from simscen.record.writer import McapWriter


class Topic(NamedTuple):
    """A topic and its message type; `latched` = transient local, so that late subscribers get the last message."""

    name: str
    type: str
    latched: bool = False


CLOCK = Topic("/clock", "rosgraph_msgs/msg/Clock")
TF = Topic("/tf", "tf2_msgs/msg/TFMessage")
TF_STATIC = Topic("/tf_static", "tf2_msgs/msg/TFMessage", latched=True)
MAP = Topic("/map", "nav_msgs/msg/OccupancyGrid", latched=True)
ROBOT_DESCRIPTION = Topic("/robot_description", "std_msgs/msg/String", latched=True)
TRUTH = Topic("/ground_truth/odom", "nav_msgs/msg/Odometry")
CLEARANCE = Topic("/simscen/clearance", "std_msgs/msg/Float64")
BELIEF = Topic("/amcl_pose", "geometry_msgs/msg/PoseWithCovarianceStamped")
PARTICLES = Topic("/particle_cloud", "nav2_msgs/msg/ParticleCloud")
PARTICLE_POSES = Topic("/particlecloud", "geometry_msgs/msg/PoseArray")
"""As AMCL published it before Nav2 had a message of its own: viewers show it without a plug-in."""
PLAN = Topic("/plan", "nav_msgs/msg/Path")
LOCAL_PLAN = Topic("/local_plan", "nav_msgs/msg/Path")
GLOBAL_COSTMAP = Topic("/global_costmap/costmap", "nav_msgs/msg/OccupancyGrid", latched=True)
LOCAL_COSTMAP = Topic("/local_costmap/costmap", "nav_msgs/msg/OccupancyGrid", latched=True)
COMMAND = Topic("/cmd_vel", "geometry_msgs/msg/Twist")
GOAL = Topic("/goal_pose", "geometry_msgs/msg/PoseStamped")
EVENTS = Topic("/simscen/events", "std_msgs/msg/String")
THINGS = Topic("/simscen/things", "visualization_msgs/msg/MarkerArray", latched=True)
SCENE = Topic("/simscen/scene", "visualization_msgs/msg/MarkerArray", latched=True)
ROSOUT = Topic("/rosout", "rcl_interfaces/msg/Log")

SCAN_TYPE = "sensor_msgs/msg/LaserScan"
ODOMETRY_TYPE = "nav_msgs/msg/Odometry"
IMU_TYPE = "sensor_msgs/msg/Imu"
IMAGE_TYPE = "sensor_msgs/msg/Image"
BUMPER_TYPE = "std_msgs/msg/Bool"

# rosbag2's metadata version 8: enums are rmw's integers, which both older and newer rosbag2 read; version 9's names
# are refused by older ones. Keep last 10 (1 when latched), reliable, automatic liveliness, no deadlines.
_QOS = """\
- history: 1
  depth: {depth}
  reliability: 1
  durability: {durability}
  deadline:
    sec: 9223372036
    nsec: 854775807
  lifespan:
    sec: 9223372036
    nsec: 854775807
  liveliness: 1
  liveliness_lease_duration:
    sec: 9223372036
    nsec: 854775807
  avoid_ros_namespace_conventions: false
"""


def qos(latched: bool) -> str:
    """`offered_qos_profiles` as rosbag2 writes it."""
    return _QOS.format(depth=1, durability=1) if latched else _QOS.format(depth=10, durability=2)


class Out(Protocol):
    """Takes messages: a log, or a stack that is told them."""

    def publish(self, topic: Topic, time: int, data: bytes) -> None:
        """Take a message at `time` nanoseconds."""
        ...


class Publisher:
    """Opens a channel the first time something is published on its topic."""

    def __init__(self, writer: McapWriter) -> None:
        self._writer = writer
        self._types: Mapping[str, MessageType] = load()
        self._channels: dict[str, int] = {}
        self._told: dict[str, int] = {}

    def once(self, topic: Topic, time: int, data: bytes) -> None:
        """Write a message at `time` nanoseconds, if there is none of that time on its topic."""
        if self._told.get(topic.name) != time:
            self._told[topic.name] = time
            self.publish(topic, time, data)

    def publish(self, topic: Topic, time: int, data: bytes) -> None:
        """Write a message at `time` nanoseconds."""
        channel = self._channels.get(topic.name)
        if channel is None:
            channel = self._channels[topic.name] = self._open(topic)
        self._writer.message(channel, time, data)

    def _open(self, topic: Topic) -> int:
        kind = self._types[topic.type]
        metadata = {"offered_qos_profiles": qos(topic.latched), "topic_type_hash": kind.hash}
        return self._writer.channel(topic.name, kind, metadata)


class Namespaced:
    """Takes the messages of one of several robots: its topics are in its namespace, as in Nav2's bringup of several.

    There is one clock for all.
    """

    def __init__(self, out: Publisher, robot: str) -> None:
        self._out, self._robot = out, robot

    def publish(self, topic: Topic, time: int, data: bytes) -> None:
        """Take a message at `time` nanoseconds."""
        if topic == CLOCK:
            self._out.once(topic, time, data)
        else:
            self._out.publish(topic._replace(name=f"/{self._robot}{topic.name}"), time, data)
