"""A node with the errors that the parameter `flaws` lists."""

import rclpy
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped, Twist, TwistStamped, Vector3
from nav_msgs.msg import Odometry
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from sensor_msgs.msg import LaserScan

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class Flawed(Node):
    def __init__(self):
        super().__init__("flawed")
        flaws = self.flaws = self.declare_parameter("flaws", [""]).value
        if "no command" not in flaws:
            self.command = self.create_publisher(Vector3 if "command type" in flaws else Twist, "cmd_vel", 10)
        if "no goals" not in flaws:
            self.create_subscription(PoseStamped, "goal_pose", lambda _: None, 10)
        if "deaf to scans" in flaws:
            self.create_subscription(LaserScan, "scan", lambda _: None, LATCHED)
        elif "scan type" in flaws:
            self.create_subscription(Odometry, "scan", lambda _: None, 10)
        elif "no sensors" not in flaws:
            self.create_subscription(LaserScan, "scan", lambda _: None, 10)
        if "another map frame" in flaws:
            self.belief = self.create_publisher(PoseWithCovarianceStamped, "amcl_pose", LATCHED)
            message = PoseWithCovarianceStamped()
            message.header.frame_id = "world"
            self.belief.publish(message)
        if "another odometry" in flaws:
            self.odometry = self.create_publisher(Odometry, "odom", 10)


def other():
    """Publish commands of another type from a second context, because one DDS participant cannot have both."""
    context = rclpy.Context()
    rclpy.init(context=context)
    node = Node("other", context=context)
    return node, node.create_publisher(TwistStamped, "cmd_vel", 10)


rclpy.init()
if __name__ == "__main__":
    flawed = Flawed()
    kept = other() if "two commands" in flawed.flaws else None
    rclpy.spin(flawed)
