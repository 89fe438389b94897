"""Topics of a log, their quality of service, and the definitions of their message types."""

import json
from functools import cache
from importlib.resources import files
from typing import NamedTuple


class Topic(NamedTuple):
    """Topic with its message type. `latched` means transient local durability."""

    name: str
    type: str
    latched: bool = False


CLOCK = Topic("/clock", "rosgraph_msgs/msg/Clock")
TF = Topic("/tf", "tf2_msgs/msg/TFMessage")
TF_STATIC = Topic("/tf_static", "tf2_msgs/msg/TFMessage", latched=True)
MAP = Topic("/map", "nav_msgs/msg/OccupancyGrid", latched=True)
ROBOT_DESCRIPTION = Topic("/robot_description", "std_msgs/msg/String", latched=True)
TRUTH = Topic("/ground_truth/odom", "nav_msgs/msg/Odometry")
FILTERED_ODOMETRY = Topic("/odometry/filtered", "nav_msgs/msg/Odometry")
"""Same topic as the output of ekf_node in robot_localization."""
CLEARANCE = Topic("/simscen/clearance", "std_msgs/msg/Float64")
BELIEF = Topic("/amcl_pose", "geometry_msgs/msg/PoseWithCovarianceStamped")
PARTICLES = Topic("/particle_cloud", "nav2_msgs/msg/ParticleCloud")
PARTICLE_POSES = Topic("/particlecloud", "geometry_msgs/msg/PoseArray")
"""Topic of the particles for viewers without nav2_msgs."""
PLAN = Topic("/plan", "nav_msgs/msg/Path")
LOCAL_PLAN = Topic("/local_plan", "nav_msgs/msg/Path")
GLOBAL_COSTMAP = Topic("/global_costmap/costmap", "nav_msgs/msg/OccupancyGrid", latched=True)
LOCAL_COSTMAP = Topic("/local_costmap/costmap", "nav_msgs/msg/OccupancyGrid", latched=True)
COMMAND = Topic("/cmd_vel", "geometry_msgs/msg/Twist")
GOAL = Topic("/goal_pose", "geometry_msgs/msg/PoseStamped")
EVENTS = Topic("/simscen/events", "std_msgs/msg/String")
OBJECT_MARKERS = Topic("/simscen/things", "visualization_msgs/msg/MarkerArray", latched=True)
SCENE_MARKERS = Topic("/simscen/scene", "visualization_msgs/msg/MarkerArray", latched=True)
ROSOUT = Topic("/rosout", "rcl_interfaces/msg/Log")

SCAN_TYPE = "sensor_msgs/msg/LaserScan"
ODOMETRY_TYPE = "nav_msgs/msg/Odometry"
IMU_TYPE = "sensor_msgs/msg/Imu"
IMAGE_TYPE = "sensor_msgs/msg/Image"
BUMPER_TYPE = "std_msgs/msg/Bool"

# Format of metadata version 8 of rosbag2: enums are the integers of rmw, which all versions of rosbag2 read. Versions
# before 9 reject names of enums. The profile is: keep last 10 (1 if latched), reliable, no deadlines.
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
    """Return the channel metadata `offered_qos_profiles` as rosbag2 writes it."""
    return _QOS.format(depth=1, durability=1) if latched else _QOS.format(depth=10, durability=2)


class MessageType(NamedTuple):
    """ROS message type.

    Attributes:
        name: Full name, such as "nav_msgs/msg/Path".
        definition: Text of the .msg file and of all nested types, in the format `ros2msg` of MCAP.
        hash: Type hash as in REP 2016.
    """

    name: str
    definition: str
    hash: str


@cache
def load_message_types() -> dict[str, MessageType]:
    """Return all message types of a log by name, from schemas.json (definitions of ROS 2 Humble)."""
    table = json.loads(files(__package__).joinpath("schemas.json").read_text("utf-8"))
    return {name: MessageType(name, entry["definition"], entry["hash"]) for name, entry in table.items()}
