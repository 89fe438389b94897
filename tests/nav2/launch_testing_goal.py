"""The drive of scenarios/navigation/goal as a test of launch_testing, in real time, with Nav2's loopback simulator.

    launch_test tests/nav2/launch_testing_goal.py env:=ENV params:=PARAMS map:=MAP

ENV and PARAMS are those of bringup.sh, and MAP comes from `simscen world export`. It is here to compare the wall time
of both tools: the same nodes drive from the same pose to the same goal. The loopback simulator (nav2_loopback_sim)
knows neither physics nor contacts, and there is no ground truth, so the test can only ask Nav2 whether it arrived.
"""

import time
import unittest
from pathlib import Path

import launch
import launch_testing.actions
import rclpy
from action_msgs.msg import GoalStatus
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped
from launch.actions import DeclareLaunchArgument, ExecuteProcess
from launch.substitutions import LaunchConfiguration
from lifecycle_msgs.msg import State
from lifecycle_msgs.srv import GetState
from nav2_msgs.action import NavigateToPose
from rclpy.action import ActionClient

BRINGUP = Path(__file__).with_name("bringup.sh")
# Both as in worlds/house.world.yaml; the robot starts with yaw 0 and ends with yaw π.
DOCK, SOFA = (0.8, 4.95), (3.1, 1.2)
TIME_LIMIT_S = 120.0


def generate_test_description():
    """Start the simulator, the map server and Nav2; the test itself waits until Nav2 is active."""
    env, params, map_file = (LaunchConfiguration(name) for name in ("env", "params", "map"))

    def node(package, executable, *arguments):
        command = ["source ", env, f" && node {package} {executable} --ros-args -p use_sim_time:=true ", *arguments]
        return ExecuteProcess(cmd=["bash", "-c", command])

    def static_transform(parent, child):
        frames = f"--frame-id {parent} --child-frame-id {child}"
        command = ["source ", env, f" && node tf2_ros static_transform_publisher {frames}"]
        return ExecuteProcess(cmd=["bash", "-c", command])

    simulator = "from nav2_loopback_sim.loopback_simulator import main; main()"
    localized_by_amcl = ["-p", "publish_map_odom_tf:=false"]
    return launch.LaunchDescription(
        [
            *(DeclareLaunchArgument(name) for name in ("env", "params", "map")),
            ExecuteProcess(cmd=["python3", "-c", simulator, "--ros-args", *localized_by_amcl]),
            static_transform("base_footprint", "base_link"),
            static_transform("base_link", "base_scan"),
            node("nav2_map_server", "map_server", "-p yaml_filename:=", map_file),
            node(
                "nav2_lifecycle_manager",
                "lifecycle_manager",
                "-r __node:=lifecycle_manager_map -p autostart:=true -p bond_timeout:=0.0 -p node_names:=[map_server]",
            ),
            ExecuteProcess(cmd=["bash", str(BRINGUP), env, params]),
            launch_testing.actions.ReadyToTest(),
        ]
    )


class TestGoal(unittest.TestCase):
    def setUp(self):
        rclpy.init()
        self.node = rclpy.create_node("test_goal")
        self.until = time.monotonic() + TIME_LIMIT_S

    def tearDown(self):
        self.node.destroy_node()
        rclpy.shutdown()

    def wait(self, future):
        while not future.done():
            self.assertLess(time.monotonic(), self.until, "Nav2 took too long")
            rclpy.spin_once(self.node, timeout_sec=0.1)
        return future.result()

    def test_robot_reaches_the_sofa(self):
        start = PoseWithCovarianceStamped()
        start.header.frame_id = "map"
        start.pose.pose.position.x, start.pose.pose.position.y = DOCK
        start.pose.pose.orientation.w = 1.0
        start.pose.covariance[0] = start.pose.covariance[7] = 0.0025
        start.pose.covariance[35] = 0.0025
        publisher = self.node.create_publisher(PoseWithCovarianceStamped, "/initialpose", 1)
        states = self.node.create_client(GetState, "/bt_navigator/get_state")
        while not states.wait_for_service(timeout_sec=0.5):
            self.assertLess(time.monotonic(), self.until, "Nav2 did not start")
        while self.wait(states.call_async(GetState.Request())).current_state.id != State.PRIMARY_STATE_ACTIVE:
            publisher.publish(start)
            time.sleep(0.5)
        goal = NavigateToPose.Goal(pose=PoseStamped())
        goal.pose.header.frame_id = "map"
        goal.pose.pose.position.x, goal.pose.pose.position.y = SOFA
        goal.pose.pose.orientation.z = 1.0
        client = ActionClient(self.node, NavigateToPose, "/navigate_to_pose")
        client.wait_for_server()
        handle = self.wait(client.send_goal_async(goal))
        result = self.wait(handle.get_result_async())
        self.assertEqual(result.status, GoalStatus.STATUS_SUCCEEDED)
