"""`simscen ros2 nav2` with a stand-in for Nav2 that has its node names and its difficult properties."""

import os
from pathlib import Path

import pytest

NODES = Path(__file__).with_name("nodes")
ACTION = ["-p", "action:=navigate_to_pose"]
NEVER_SPUN = "/bt_navigator_navigate_to_pose_rclcpp_node"


def test_nav2_becomes_active_without_a_warm_up_and_nodes_that_are_never_spun_are_named(with_interfaces, run) -> None:
    ended = run("nav2", "--launch", with_interfaces.node("nav2_like", *ACTION), scenario="short.scenario.yaml")
    assert ended.code == 0, ended.output
    about = ended.about
    assert about["goals"] == "/navigate_to_pose"
    assert {"/amcl", "/bt_navigator", "/global_costmap"} <= set(about["nodes"])
    assert NEVER_SPUN in about["not_in_step"]
    assert NEVER_SPUN not in about["nodes"]
    assert ended.output.count(f"warning: {NEVER_SPUN}") == 1
    printed = next(ended.out.rglob("stack.log")).read_text()
    assert "Traceback" not in printed


@pytest.mark.slow
@pytest.mark.parametrize("words", [["--warm-up", "3"], ["--sync", "paced"]], ids=["warm-up", "paced"])
def test_nav2_runs_after_a_warm_up_and_paced(with_interfaces, run, words: list[str]) -> None:
    launch = with_interfaces.node("nav2_like", *ACTION, after=1.5)
    ended = run("nav2", *words, "--launch", launch, scenario="short.scenario.yaml")
    assert ended.code == 0, ended.output


@pytest.mark.slow
def test_ready_option_extends_the_time_for_the_bringup(with_interfaces, run) -> None:
    launch = with_interfaces.node("nav2_like", *ACTION, slow=35.0)
    ended = run("nav2", "--ready", "90", "--launch", launch, scenario="short.scenario.yaml")
    assert ended.code == 0, ended.output


@pytest.mark.slow
@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        pytest.param({"misfit": "planner_server"}, "there is no node planner_server", marks=pytest.mark.slow),
        pytest.param(
            {"misfit": "frame"},
            "amcl: base_frame_id is 'base_footprint'; simscen's base frame is 'base_link': --base-frame",
            marks=pytest.mark.slow,
        ),
        (
            {"never": "behavior_server"},
            "the lifecycle node /behavior_server is unconfigured, not active",
        ),
    ],
    ids=["no such node", "a parameter", "never active"],
)
def test_an_unusable_nav2_is_an_error_that_names_the_node(
    with_interfaces, run, alive, parameters: dict[str, str], message: str
) -> None:
    tag = f"nav2{os.getpid()}"
    launch = with_interfaces.node("nav2_like", *ACTION, tag=tag, **parameters)
    ended = run("nav2", "--ready", "8", "--launch", launch)
    assert ended.code == 3
    assert message in ended.output
    assert alive(tag) == []


@pytest.mark.slow
def test_an_aborted_bring_up_is_started_again_once(with_interfaces, run, tmp_path: Path) -> None:
    aborted = with_interfaces.node("nav2_like", *ACTION, aborts="behavior_server")
    complete = with_interfaces.node("nav2_like", *ACTION)
    launch = f"if mkdir {tmp_path}/tried; then {aborted}; else {complete}; fi"
    ended = run("nav2", "--launch", launch, scenario="short.scenario.yaml")
    assert ended.code == 0, ended.output
    (warning, *_) = ended.about["warnings"]
    assert warning == "the launched command was started again, because lifecycle_manager had given up the bring-up"
    log = next(ended.out.rglob("stack.log")).read_text()
    assert "lifecycle_manager has given up the bring-up: the lifecycle node /behavior_server is unconfigured" in log


@pytest.mark.slow
def test_a_bring_up_that_is_aborted_twice_is_an_error(with_interfaces, run, alive) -> None:
    tag = f"aborts{os.getpid()}"
    launch = with_interfaces.node("nav2_like", *ACTION, tag=tag, aborts="behavior_server")
    ended = run("nav2", "--launch", launch)
    assert ended.code == 3
    assert "lifecycle_manager has given up the bring-up" in ended.output
    assert alive(tag) == []


@pytest.mark.slow
def test_a_server_that_dies_during_the_run_is_named(with_interfaces, run, alive) -> None:
    launch = with_interfaces.node("nav2_like", *ACTION, dies="planner_server", dies_at=2.0)
    ended = run("nav2", "--answer", "2", "--launch", launch, scenario="short.scenario.yaml")
    assert ended.code == 3, ended.output
    assert "/planner_server" in ended.output
    assert alive("planner_server", str(with_interfaces.python)) == []


def test_nav2_needs_tf2_msgs_and_nav2_msgs(ros, run, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("PYTHONPATH", str(NODES.with_name("without")))
    launched = tmp_path / "launched"
    ended = run("nav2", "--launch", f"touch {launched}")
    assert ended.code == 3
    assert "has no tf2_msgs, nav2_msgs" in ended.output
    assert not launched.exists()
