"""A stand-in for Nav2: nodes with its names, parameters, lifecycle, and the properties that make a real Nav2 difficult.

- The client nodes of the behavior tree (`bt_navigator_*_rclcpp_node`) are never spun: they answer no request.
- Activating controller_server blocks its executor until /tf has odom -> base_link, as its costmap does.
- A lifecycle manager activates the servers one after another, on wall time.

Parameters: `after` (simulated seconds until activation starts), `slow` (wall seconds until the nodes exist),
`misfit` (a server to leave out, or "frame"), `never` (a server that is never activated), `aborts` (a server that cannot
be activated, so that the lifecycle manager gives up), `dies` (a server whose process is killed) at `dies_at` (simulated
seconds), and those of the navigator.
"""

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import rclpy
from navigator import Navigator
from rclpy.clock import Clock, ClockType
from rclpy.executors import SingleThreadedExecutor
from rclpy.lifecycle import LifecycleNode, TransitionCallbackReturn
from rclpy.node import Node
from rclpy.parameter import Parameter
from tf2_msgs.msg import TFMessage

SERVERS = {
    "amcl": {"base_frame_id": "base_link", "scan_topic": "scan"},
    "bt_navigator": {"robot_base_frame": "base_link", "odom_topic": "/odom"},
    "planner_server": {},
    "behavior_server": {"robot_base_frame": "base_link"},
    "local_costmap": {"robot_base_frame": "base_link"},
    "global_costmap": {
        "plugins": ["obstacle_layer"],
        "obstacle_layer.observation_sources": "scan",
        "obstacle_layer.scan.topic": "/scan",
    },
    "controller_server": {"odom_topic": "odom"},
}
NEVER_SPUN = ("bt_navigator_navigate_to_pose_rclcpp_node", "bt_navigator_navigate_through_poses_rclcpp_node")
WALL = Clock(clock_type=ClockType.STEADY_TIME)


class Server(LifecycleNode):
    def __init__(self, name, parameters=None):
        super().__init__(name)
        for key, value in (parameters or {}).items():
            self.declare_parameter(key, value)

    def activate_soon(self):
        """Configure and activate in this node's own executor."""

        def once():
            timer.cancel()
            self.trigger_configure()
            self.trigger_activate()

        timer = self.create_timer(0.01, once, clock=WALL)


class ControllerServer(Server):
    """Waits for the robot's pose in the odometry frame, as the local costmap does while it is activated."""

    def on_activate(self, state):
        found = threading.Event()
        listener = Node("transform_listener_impl_controller")

        def on_transforms(message):
            if any(link.header.frame_id == "odom" for link in message.transforms):
                found.set()

        listener.create_subscription(TFMessage, "/tf", on_transforms, 100)
        executor = SingleThreadedExecutor()
        executor.add_node(listener)
        while rclpy.ok() and not found.is_set():
            executor.spin_once(timeout_sec=0.1)
        executor.remove_node(listener)
        listener.destroy_node()
        return TransitionCallbackReturn.SUCCESS


def spin(node):
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    try:
        executor.spin()
    except Exception:
        if rclpy.ok():  # else the process is being ended
            raise


def main():
    rclpy.init()
    if len(sys.argv) > 1 and sys.argv[1] == "--only":  # one server in a process of its own
        server = Server(sys.argv[2], SERVERS[sys.argv[2]])
        server.activate_soon()
        spin(server)
        return
    parameters = Node("parameters_of_the_stand_in", start_parameter_services=False)
    slow = parameters.declare_parameter("slow", 0.0).value
    parameters.destroy_node()
    time.sleep(slow)
    navigator = Navigator()
    after, misfit, never, aborts, dies = (
        navigator.declare_parameter(name, default).value
        for name, default in (("after", 0.0), ("misfit", ""), ("never", ""), ("aborts", ""), ("dies", ""))
    )
    manager = Node("lifecycle_manager")
    dies_at = navigator.declare_parameter("dies_at", 0.0).value
    servers = {
        name: (ControllerServer if name == "controller_server" else Server)(name, values)
        for name, values in SERVERS.items()
        if name not in (misfit, dies)
    }
    if misfit == "frame":
        servers["amcl"].set_parameters([Parameter("base_frame_id", value="base_footprint")])
    kept = [Node(name) for name in NEVER_SPUN]
    for server in (*servers.values(), manager):
        threading.Thread(target=spin, args=(server,), daemon=True).start()
    other = None
    if dies:
        command = [sys.executable, str(Path(__file__)), "--only", dies, "--ros-args", "-p", "use_sim_time:=true"]
        other = subprocess.Popen(command)

    def manage():
        """Activate one server after another; the next one when the last is active."""
        while rclpy.ok() and navigator.get_clock().now().nanoseconds < after * 1e9:
            time.sleep(0.05)
        for name, server in servers.items():
            if name == never:
                return
            if name == aborts:
                manager.get_logger().error("Failed to bring up all requested nodes. Aborting bringup.")
                return
            server.activate_soon()
            while rclpy.ok() and server._state_machine.current_state[1] != "active":
                time.sleep(0.02)

    def kill_when_due():
        if navigator.get_clock().now().nanoseconds >= dies_at * 1e9:
            other.send_signal(signal.SIGKILL)

    if other is not None:
        navigator.create_timer(0.1, kill_when_due)
    threading.Thread(target=manage, daemon=True).start()
    try:
        spin(navigator)
    finally:
        del kept
        os._exit(0)


if __name__ == "__main__":
    main()
