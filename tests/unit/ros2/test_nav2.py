"""Tests of the check that Nav2's parameters match the topics and frames of simscen."""

import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

from simscen.cli.main import app
from simscen.core.errors import InvalidInput, UsageError
from simscen.ros2.nav2.parameter_rules import ParameterProblem, PublishedNames, check, relevant_parameters

PUBLISHED = PublishedNames(["/scan", "/rear/scan"], "/odom", ["base_link"])
VALID_PARAMETERS = """\
amcl:
  ros__parameters:
    use_sim_time: true
    base_frame_id: base_link
    odom_frame_id: odom
    global_frame_id: map
    scan_topic: scan
bt_navigator:
  ros__parameters:
    global_frame: map
    robot_base_frame: base_link
    odom_topic: /odom
    plugin_lib_names: [nav2_compute_path_to_pose_action_bt_node]
local_costmap:
  local_costmap:
    ros__parameters:
      global_frame: odom
      robot_base_frame: base_link
      plugins: [voxel_layer, inflation_layer]
      voxel_layer:
        plugin: nav2_costmap_2d::VoxelLayer
        observation_sources: scan
        scan:
          topic: /scan
          data_type: LaserScan
collision_monitor:
  ros__parameters:
    base_frame_id: base_link
    odom_frame_id: odom
    observation_sources: [scan]
    scan: {type: scan, topic: scan}
"""


def parameter_problems(node: str, **parameters: object) -> list[ParameterProblem]:
    return check({node: {key.replace("__", "."): value for key, value in parameters.items()}}, PUBLISHED)


@pytest.mark.parametrize(
    ("node", "parameters", "message"),
    [
        ("amcl", {"base_frame_id": "base_footprint"}, "base_frame_id is 'base_footprint'; simscen's base frame is"),
        ("amcl", {"odom_frame_id": "odometry"}, "odom_frame_id is 'odometry'; expected 'odom'"),
        ("amcl", {"scan_topic": "front"}, "scan_topic is 'front', which no node publishes; simscen's scans: /scan, "),
        ("bt_navigator", {"global_frame": "world"}, "global_frame is 'world'; expected 'map'"),
        ("controller_server", {"odom_topic": "odometry/filtered"}, "odom_topic is 'odometry/filtered', which no node"),
        ("velocity_smoother", {"odom_topic": "wheels"}, "odom_topic is 'wheels', which no node publishes"),
        ("behavior_server", {"local_frame": "map"}, "local_frame is 'map'; expected 'odom'"),
        ("collision_monitor", {"base_frame_id": "chassis"}, "base_frame_id is 'chassis'"),
        (
            "global_costmap",
            {"plugins": ["o"], "o__observation_sources": "a b", "o__a__topic": "/scan", "o__b__topic": "/front"},
            "o.b.topic is '/front', which no node publishes",
        ),
    ],
)
def test_a_wrong_parameter_is_found_in_each_node(node: str, parameters: dict[str, object], message: str) -> None:
    [problem] = parameter_problems(node, **parameters)
    assert (problem.node, problem.is_severe) == (node, True)
    assert problem.message.startswith(message)


def test_a_point_cloud_source_is_a_warning_unless_it_is_disabled() -> None:
    source = {"plugins": ["o"], "o__observation_sources": "cloud", "o__cloud__data_type": "PointCloud2"}
    [problem] = parameter_problems("local_costmap", **source)
    assert (problem.parameter, problem.is_severe) == ("o.cloud.data_type", False)
    assert parameter_problems("local_costmap", **source, o__cloud__enabled=False) == []


@pytest.mark.parametrize("disabled", ["o", "o.front"], ids=["layer", "source"])
def test_topics_of_disabled_sources_are_not_checked(disabled: str) -> None:
    layer = {"plugins": ["o"], "o.observation_sources": "front", "o.front.topic": "/front"}
    assert len(parameter_problems("local_costmap", **layer)) == 1
    assert parameter_problems("local_costmap", **layer, **{f"{disabled}.enabled": False}) == []


def test_disabled_source_of_the_collision_monitor_is_not_checked() -> None:
    monitor = {"observation_sources": ["front"], "front.type": "scan", "front.topic": "/front"}
    assert len(parameter_problems("collision_monitor", **monitor)) == 1
    assert parameter_problems("collision_monitor", **monitor, **{"front.enabled": False}) == []


def test_wall_time_is_a_warning_because_a_launch_file_may_set_it() -> None:
    [problem] = parameter_problems("planner_server", use_sim_time=False)
    assert not problem.is_severe


def test_only_parameters_of_the_rules_are_requested() -> None:
    known = ["plugins", "o.observation_sources", "o.scan.topic", "resolution", "robot_base_frame", "alpha1"]
    assert relevant_parameters("local_costmap", known) == [
        "plugins",
        "o.observation_sources",
        "o.scan.topic",
        "robot_base_frame",
    ]
    assert relevant_parameters("amcl", ["alpha1", "scan_topic"]) == ["scan_topic"]


def run_check(folder: Path, text: str, *options: str) -> tuple[int, str]:
    """Run `simscen ros2 nav2` on a parameter file; return the exit code, and the output or the errors."""
    file = folder / "nav2_params.yaml"
    file.write_text(text)
    try:
        completed = CliRunner().invoke(app, ["ros2", "nav2", "--params", str(file), *options], catch_exceptions=False)
    except InvalidInput as error:
        return 2, "\n".join(f"{p.line}:{p.col} {p.code} {p.message}" for p in error.problems)
    return completed.exit_code, completed.output


@pytest.mark.parametrize(
    ("topic", "is_found"), [("scan", True), ("/robot1/scan", True), ("/scan", False), ("robot1/scan", False)]
)
def test_topics_without_a_slash_are_relative_to_the_namespace(topic: str, is_found: bool) -> None:
    published = PublishedNames(["/robot1/scan"], "/robot1/odom", ["base_link"], "/robot1")
    assert bool(check({"amcl": {"scan_topic": topic}}, published)) is not is_found


@pytest.mark.parametrize(
    ("subscriptions", "is_found"),
    [(None, True), ({"amcl": {"/lidar"}}, True), ({"amcl": {"/scan"}}, False), ({}, False)],
    ids=["file", "as the parameter says", "remapped", "not configured yet"],
)
def test_a_topic_that_a_running_node_has_remapped_is_not_wrong(
    subscriptions: dict[str, set[str]] | None, is_found: bool
) -> None:
    problems = check({"amcl": {"scan_topic": "lidar"}}, PUBLISHED, subscriptions)
    assert [problem.parameter for problem in problems] == ["scan_topic"] * is_found


def test_a_correct_file_passes(tmp_path: Path) -> None:
    code, output = run_check(tmp_path, VALID_PARAMETERS)
    assert code == 0
    assert "Nav2 can work with" in output


def test_wrong_parameters_of_a_file_are_reported_with_their_lines(tmp_path: Path) -> None:
    text = VALID_PARAMETERS.replace(
        "base_frame_id: base_link\n    odom_frame_id: odom\n    global", "base_frame_id: base\n    global"
    )
    text = text.replace("topic: /scan", "topic: /front")
    code, output = run_check(tmp_path, text)
    assert code == 2
    lines = text.split("\n")
    places = [next(i for i, line in enumerate(lines, 1) if key in line) for key in ("base_frame_id: base", "/front")]
    assert [int(line.partition(":")[0]) for line in output.split("\n")] == places
    assert all("SC340" in line for line in output.split("\n"))


def test_a_second_name_of_the_base_frame_is_accepted(tmp_path: Path) -> None:
    text = VALID_PARAMETERS.replace("base_link", "base_footprint")
    assert run_check(tmp_path, text)[0] == 2
    assert run_check(tmp_path, text, "--base-frame", "base_footprint")[0] == 0


def test_another_name_of_the_base_frame_is_accepted(tmp_path: Path) -> None:
    text = VALID_PARAMETERS.replace("base_link", "chassis")
    assert run_check(tmp_path, text, "--frame", "base_link:=chassis")[0] == 0
    assert run_check(tmp_path, VALID_PARAMETERS, "--frame", "base_link:=chassis")[0] == 2


def test_check_of_a_file_uses_the_given_topic_names(tmp_path: Path) -> None:
    text = VALID_PARAMETERS.replace("topic: /scan", "topic: scan").replace("topic: scan", "topic: /front/scan")
    assert run_check(tmp_path, text)[0] == 2
    assert run_check(tmp_path, text, "--remap", "/scan:=/front/scan")[0] == 0
    assert run_check(tmp_path, VALID_PARAMETERS.replace("topic: /", "topic: "), "--namespace", "robot1")[0] == 0
    with pytest.raises(UsageError, match="not of the form /from:=/to"):
        run_check(tmp_path, VALID_PARAMETERS, "--remap", "scan")


@pytest.mark.parametrize(
    ("rename", "message"),
    [
        ("lidar=base_scan", "--frame lidar=base_scan: not of the form FRAME:=NAME"),
        ("odom:=robot1/odom", "odom cannot be renamed, only base_link and frames of sensors"),
    ],
)
def test_a_frame_that_cannot_be_renamed_is_a_usage_error(tmp_path: Path, rename: str, message: str) -> None:
    (tmp_path / "nav2_params.yaml").write_text(VALID_PARAMETERS)
    words = ["ros2", "nav2", "--params", str(tmp_path / "nav2_params.yaml"), "--frame", rename]
    with pytest.raises(UsageError, match=re.escape(message)):
        CliRunner().invoke(app, words, catch_exceptions=False)


def test_a_file_without_parameters_of_nodes_is_refused(tmp_path: Path) -> None:
    code, output = run_check(tmp_path, "amcl: {alpha1: 0.2}\n")
    assert code == 2
    assert "it has no key ros__parameters" in output


def test_a_call_outside_a_run_is_a_usage_error() -> None:
    with pytest.raises(UsageError, match="no run to connect to"):
        CliRunner().invoke(app, ["ros2", "--launch", "node"], catch_exceptions=False)


def test_page_on_nav2_shows_the_real_messages(tmp_path: Path) -> None:
    page = (Path(__file__).parents[3] / "docs/tutorials/my-nav2.md").read_text(encoding="utf-8")
    text = """\
amcl:
  ros__parameters:
    base_frame_id: base_footprint
local_costmap:
  local_costmap:
    ros__parameters:
      plugins: [obstacle_layer]
      obstacle_layer:
        plugin: nav2_costmap_2d::ObstacleLayer
        observation_sources: scan
        scan:
          topic: /front/scan
"""
    _, output = run_check(tmp_path, text)
    for line in output.split("\n"):
        place, code, message = line.split(" ", 2)
        assert f"nav2_params.yaml:{place}: error[{code}] {message}\n" in page


@pytest.mark.parametrize(("node", "key"), [("local_costmap", "plugins"), ("collision_monitor", "observation_sources")])
@pytest.mark.parametrize("value", [5, True, "scan"])
def test_a_list_of_names_of_another_type_is_a_problem(node: str, key: str, value: object) -> None:
    (problem,) = parameter_problems(node, **{key: value})
    assert problem == ParameterProblem(node, key, f"{key} is {value!r}; expected a list of names")
