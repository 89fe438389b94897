"""Errors about an incomplete graph are exact, and simscen publishes what Nav2 subscribes to."""

import json
from pathlib import Path

import pytest

ASKED = {
    # topic: type, reliability and durability that Nav2's subscribers request, and where that is defined
    "/clock": ("rosgraph_msgs/msg/Clock", "BEST_EFFORT", "VOLATILE"),  # rclcpp::ClockQoS
    "/scan": ("sensor_msgs/msg/LaserScan", "BEST_EFFORT", "VOLATILE"),  # amcl, obstacle layer: SensorDataQoS
    "/odom": ("nav_msgs/msg/Odometry", "RELIABLE", "VOLATILE"),  # bt_navigator, controller_server: odom_topic
    "/tf": ("tf2_msgs/msg/TFMessage", "RELIABLE", "VOLATILE"),  # tf2_ros::DynamicListenerQoS
    "/tf_static": ("tf2_msgs/msg/TFMessage", "RELIABLE", "TRANSIENT_LOCAL"),  # tf2_ros::StaticListenerQoS
    "/map": (
        "nav_msgs/msg/OccupancyGrid",
        "RELIABLE",
        "TRANSIENT_LOCAL",
    ),  # static layer: transient local
    "/robot_description": ("std_msgs/msg/String", "RELIABLE", "TRANSIENT_LOCAL"),  # what robot_state_publisher offers
    "/initialpose": ("geometry_msgs/msg/PoseWithCovarianceStamped", "RELIABLE", "VOLATILE"),  # amcl
}
"""https://docs.nav2.org/setup_guides and /configuration; rclcpp/qos.hpp, tf2_ros/qos.hpp."""
TREE = {("map", "odom"), ("odom", "base_link"), ("base_link", "lidar")}
"""REP 105: localization gives map→odom, odometry odom→base_link; https://docs.nav2.org/setup_guides/transformation."""
READY = "6"
"""Seconds: a node takes two or three to be there."""
STRENGTH = {"BEST_EFFORT": 0, "RELIABLE": 1, "VOLATILE": 0, "TRANSIENT_LOCAL": 1}


def test_topics_types_qos_and_frames_match_nav2(with_interfaces, run, tmp_path: Path) -> None:
    ros, file = with_interfaces, tmp_path / "probe.json"
    ended = run("--launch", f"{ros.node('navigator')} & {ros.node('probe', file=file)}")
    assert ended.code == 0, ended.output
    seen = json.loads(file.read_text())
    for topic, (kind, reliability, durability) in ASKED.items():
        offered = seen["offered"][topic]
        assert offered[0] == kind
        assert STRENGTH[offered[1]] >= STRENGTH[reliability], topic
        assert STRENGTH[offered[2]] >= STRENGTH[durability], topic
    assert not [topic for topic in seen["offered"] if topic.startswith("/simscen") or topic.endswith("/exact")]
    assert set(map(tuple, seen["frames"])) >= TREE
    assert seen["scans"] == ["lidar"]


@pytest.mark.slow
def test_frames_have_the_names_of_the_users_graph(with_interfaces, run, tmp_path: Path) -> None:
    ros, file = with_interfaces, tmp_path / "probe.json"
    names = ["--frame", "lidar:=base_scan", "--frame", "base_link:=chassis", "--base-frame", "base_footprint"]
    ended = run(*names, "--launch", f"{ros.node('navigator')} & {ros.node('probe', file=file)}")
    assert ended.code == 0, ended.output
    seen = json.loads(file.read_text())
    links = {("odom", "chassis"), ("chassis", "base_scan"), ("chassis", "base_footprint")}
    assert set(map(tuple, seen["frames"])) >= links
    assert seen["scans"] == ["base_scan"]


@pytest.mark.slow
def test_a_sensor_without_a_frame_is_named_with_the_option(with_interfaces, run) -> None:
    ended = run("--ready", READY, "--without", "/tf_static", "--launch", with_interfaces.node("navigator"))
    assert ended.code == 3
    assert (
        "no node publishes the frame lidar, and /tf_static of simscen is left out: --frame lidar:=NAME" in ended.output
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    "flaws",
    [
        {
            "no command": "no node publishes /cmd_vel (geometry_msgs/msg/Twist or geometry_msgs/msg/TwistStamped)",
            "no goals": "no node takes goals: no ",
            "scan type": "/flawed subscribes to /scan as nav_msgs/msg/Odometry; simscen publishes sensor_msgs/msg/",
        },
        pytest.param(
            {
                "deaf to scans": "/flawed receives nothing on /scan: it requests durability transient local, simscen",
                "another odometry": "/flawed publishes /odom as well: do not start that node, or use --without",
            },
            marks=pytest.mark.slow,
        ),
        pytest.param(
            {
                "command type": "/flawed publishes /cmd_vel as geometry_msgs/msg/Vector3, not geometry_msgs/msg/Twist",
                "no sensors": "no node subscribes to any sensor: /",
            },
            marks=pytest.mark.slow,
        ),
        pytest.param(
            {"two commands": "/cmd_vel is published both as Twist and as TwistStamped: /flawed (geometry_msgs/"},
            marks=pytest.mark.slow,
        ),
        pytest.param(
            {"another map frame": "/amcl_pose is in the frame 'world'; simscen's map frame is 'map'"},
            marks=pytest.mark.slow,
        ),
    ],
    ids=", ".join,
)
def test_an_incomplete_graph_is_an_exact_error(ros, run, flaws: dict[str, str]) -> None:
    ended = run("--ready", READY, "--launch", ros.node("flawed", flaws=list(flaws)))
    assert ended.code == 3
    for message in flaws.values():
        assert message in ended.output


@pytest.mark.slow
def test_nodes_on_wall_time_and_inactive_lifecycle_nodes_are_named(ros, run) -> None:
    awake = ros.node("flawed", "-r", "cmd_vel:=other", sim_time=False)
    ended = run("--ready", READY, "--launch", f"{awake} & {ros.node('sleeper')}")
    assert ended.code == 3
    assert "/flawed uses wall time: start it with use_sim_time true" in ended.output
    assert "the lifecycle node /sleeper is unconfigured, not active" in ended.output


@pytest.mark.slow
def test_the_remapping_for_a_topic_with_another_name_is_suggested(ros, run) -> None:
    ended = run("--ready", READY, "--launch", ros.node("navigator", "-r", "scan:=front", "-r", "cmd_vel:=base/cmd_vel"))
    assert ended.code == 3
    assert "--remap /cmd_vel:=/base/cmd_vel" in ended.output
    assert "--remap /scan:=/front" in ended.output


@pytest.mark.slow
def test_the_output_of_a_launch_command_that_exits_is_shown(ros, run) -> None:
    ended = run("--launch", "echo no such package: nav >&2; exit 7")
    assert ended.code == 3
    assert "the launched command ended with exit code 7" in ended.output
    assert "no such package: nav" in ended.output
