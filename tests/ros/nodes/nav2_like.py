"""Nav2's nodes by name, as lifecycle nodes that become active `after` seconds of simulated time, and one navigator.

Stands for Nav2 where it cannot be had: names of nodes, parameters, lifecycle; nothing is active before time goes on.
"""

import rclpy
from navigator import Navigator
from rclpy.executors import SingleThreadedExecutor
from rclpy.lifecycle import LifecycleNode
from rclpy.parameter import Parameter

SERVERS = {
    "amcl": {"base_frame_id": "base_link", "scan_topic": "scan"},
    "bt_navigator": {"robot_base_frame": "base_link", "odom_topic": "/odom"},
    "controller_server": {"odom_topic": "odom"},
    "planner_server": {},
    "behavior_server": {"robot_base_frame": "base_link"},
    "local_costmap": {"robot_base_frame": "base_link"},
    "global_costmap": {
        "plugins": ["obstacle_layer"],
        "obstacle_layer.observation_sources": "scan",
        "obstacle_layer.scan.topic": "/scan",
    },
}


class Server(LifecycleNode):
    def __init__(self, name, parameters):
        super().__init__(name)
        for key, value in parameters.items():
            self.declare_parameter(key, value)


rclpy.init()
navigator = Navigator()
after = navigator.declare_parameter("after", 0.0).value
misfit = navigator.declare_parameter("misfit", "").value
servers = [Server(name, parameters) for name, parameters in SERVERS.items() if name != misfit]
for server in servers:
    if server.get_name() == "amcl" and misfit == "frame":
        server.set_parameters([Parameter("base_frame_id", value="base_footprint")])


def activate():
    if navigator.get_clock().now().nanoseconds >= after * 1e9:
        timer.cancel()
        for server in servers:
            server.trigger_configure()
            server.trigger_activate()


timer = navigator.create_timer(0.05, activate)
executor = SingleThreadedExecutor()
for node in (navigator, *servers):
    executor.add_node(node)
executor.spin()
