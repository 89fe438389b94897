"""A lifecycle node with everything that a run needs, but not active."""

import rclpy
from geometry_msgs.msg import PoseStamped, Twist
from rclpy.lifecycle import LifecycleNode
from sensor_msgs.msg import LaserScan

rclpy.init()
node = LifecycleNode("sleeper")
publisher = node.create_publisher(Twist, "cmd_vel", 10)
node.create_subscription(LaserScan, "scan", lambda _: None, 10)
node.create_subscription(PoseStamped, "goal_pose", lambda _: None, 10)
rclpy.spin(node)
