"""Regenerate simscen/record/schemas.json: `python tests/unit/record/schemas_from_rosbags.py`.

rosbags contains the message definitions and hashes of ROS 2 Humble. With schemas.json, simscen itself needs neither
ROS nor rosbags.
"""

import json
from pathlib import Path

from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore

SCHEMAS = Path(__file__).parents[3] / "simscen" / "record" / "schemas.json"

TYPES = (
    "geometry_msgs/msg/PoseArray",
    "geometry_msgs/msg/PoseStamped",
    "geometry_msgs/msg/PoseWithCovarianceStamped",
    "geometry_msgs/msg/Twist",
    "nav2_msgs/msg/ParticleCloud",
    "nav_msgs/msg/OccupancyGrid",
    "nav_msgs/msg/Odometry",
    "nav_msgs/msg/Path",
    "rcl_interfaces/msg/Log",
    "rosgraph_msgs/msg/Clock",
    "sensor_msgs/msg/Image",
    "sensor_msgs/msg/Imu",
    "sensor_msgs/msg/LaserScan",
    "std_msgs/msg/Bool",
    "std_msgs/msg/Float64",
    "std_msgs/msg/String",
    "tf2_msgs/msg/TFMessage",
    "visualization_msgs/msg/MarkerArray",
)

# rosbags has no nav2_msgs; these are the files of navigation2's humble branch, without their comments.
NAV2 = {
    "nav2_msgs/msg/Particle": "geometry_msgs/Pose pose\nfloat64 weight\n",
    "nav2_msgs/msg/ParticleCloud": "std_msgs/Header header\nnav2_msgs/Particle[] particles\n",
}


def humble() -> Typestore:
    """Return a type store with the messages of ROS 2 Humble and those of nav2_msgs that simscen writes."""
    store = get_typestore(Stores.ROS2_HUMBLE)
    for name, text in NAV2.items():
        store.register(get_types_from_msg(text, name))
    return store


def expected_schemas() -> dict[str, dict[str, str]]:
    """Return the expected content of schemas.json."""
    store = humble()
    return {
        name: {"hash": store.hash_rihs01(name), "definition": store.generate_msgdef(name, ros_version=2)[0]}
        for name in TYPES
    }


if __name__ == "__main__":
    SCHEMAS.write_text(json.dumps(expected_schemas(), indent=1) + "\n")
