"""Write simscen's topics with their quality of service and the received frames to `file` after `seconds`."""

import json
from pathlib import Path

import rclpy
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import LaserScan

LATCHED = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
DYNAMIC = QoSProfile(depth=100, reliability=ReliabilityPolicy.BEST_EFFORT)


class Probe(Node):
    def __init__(self):
        super().__init__("probe")
        self.file = self.declare_parameter("file", "").value
        seconds = self.declare_parameter("seconds", 2.0).value
        self.frames, self.scans = set(), set()
        self.create_subscription(LaserScan, "/scan", lambda scan: self.scans.add(scan.header.frame_id), DYNAMIC)
        try:
            from tf2_msgs.msg import TFMessage
        except ImportError:
            pass
        else:
            self.create_subscription(TFMessage, "/tf", self.on_links, DYNAMIC)
            self.create_subscription(TFMessage, "/tf_static", self.on_links, LATCHED)
        self.create_timer(seconds, self.write)

    def on_links(self, message):
        self.frames |= {(link.header.frame_id, link.child_frame_id) for link in message.transforms}

    def write(self):
        offered = {}
        for name, _ in self.get_topic_names_and_types():
            for end in self.get_publishers_info_by_topic(name):
                if end.node_name == "simscen":
                    profile = end.qos_profile
                    offered[name] = [end.topic_type, profile.reliability.name, profile.durability.name, profile.depth]
        text = {"offered": offered, "frames": sorted(self.frames), "scans": sorted(self.scans)}
        Path(self.file).write_text(json.dumps(text))


rclpy.init()
rclpy.spin(Probe())
